"""Pictures of cameras, with detections."""
