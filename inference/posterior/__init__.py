"""What a posterior answers."""
