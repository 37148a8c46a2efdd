"""The page on which a person annotates keypoints, and the server behind it."""
