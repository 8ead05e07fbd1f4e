"""Sweeps over many postures and cases, as labelled Datasets; on this machine or a cluster."""
