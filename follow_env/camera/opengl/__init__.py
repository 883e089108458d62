"""The same pictures from a graphics chip."""
