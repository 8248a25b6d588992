"""Runs of a study on a cluster of Dask: on this computer its `Cluster`, beside each of Dask's workers stations."""

from shoal.campaigns.cluster.address import parse_cluster_address
from shoal.campaigns.cluster.dask_executor import DaskExecutor

__all__ = ["DaskExecutor", "parse_cluster_address"]
