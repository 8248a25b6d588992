"""Runs of a study on a Dask cluster: the executor on this computer, and the processes for jobs beside each worker."""

from shoal.campaigns.cluster.address import to_dask_address
from shoal.campaigns.cluster.dask_executor import DaskExecutor

__all__ = ["DaskExecutor", "to_dask_address"]
