"""Measuring fairly: workloads, protocols, the floor, pictures against a reference, and the report."""
