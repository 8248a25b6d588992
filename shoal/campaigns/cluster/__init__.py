"""Runs of a study on a cluster of Dask: on this computer its `Cluster`, beside each of Dask's workers stations."""

from shoal.campaigns.cluster.address import cluster_address
from shoal.campaigns.cluster.cluster import Cluster

__all__ = ["Cluster", "cluster_address"]
