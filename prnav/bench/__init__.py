"""Benchmarks: each prints ``name metric value unit`` lines or JSON rows with the device and the version."""
