"""What the RGB-D sensor makes of a rendered picture."""
