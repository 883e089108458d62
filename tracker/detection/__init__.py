"""The person detector of paper A: priors, networks, loss, data from our own renderer, training and evaluation."""
