"""The next experiment: the gripper motion on which models that are tied disagree most."""
