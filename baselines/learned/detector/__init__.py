"""Training of the person detector: pictures, loss, evaluation."""
