"""What people look at: videos, contact sheets, tracks in recordings."""
