"""Charts, tiles, depth contours and detections on the map."""
