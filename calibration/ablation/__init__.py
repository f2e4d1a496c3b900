"""What each part of the diagnosis is worth: drop it, refit the model on what is left, compare."""
