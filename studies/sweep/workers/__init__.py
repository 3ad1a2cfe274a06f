"""Where cases are solved: processes of this machine, or those of a Dask cluster."""
