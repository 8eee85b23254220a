"""Benchmarks: workloads, protocols, the floor of the machine, quality against a reference, and the report."""
