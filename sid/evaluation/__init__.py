"""Detections against what people marked: ground truth, scores, intervals, calibration, stability."""
