"""Sweeps over many postures and cases, as labelled Datasets; in memory, on dask, or in a store."""
