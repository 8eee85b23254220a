"""Pictures, height maps and ground truth, in and out."""
