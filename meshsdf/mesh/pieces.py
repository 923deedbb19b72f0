"""Connected pieces of a graph."""

import numpy as np


def connected_labels(n_nodes: int, links: np.ndarray) -> np.ndarray:
    """Number the connected pieces of a graph; (n_nodes,) int32 labels without gaps.

    Parameters
    ----------
    n_nodes : int
        Nodes are 0 ... n_nodes - 1.
    links : (l, 2) int
        Pairs of nodes that hang together.
    """
    # Imported here: it takes longer than the check of a closed mesh, which never comes here
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    weights = np.ones(len(links), dtype=np.int8)
    graph = coo_array((weights, (links[:, 0], links[:, 1])), shape=(n_nodes, n_nodes))
    return connected_components(graph, directed=False)[1].astype(np.int32)
