"""Stereo obstacle perception and avoidance for ground robots, on a CPU."""
