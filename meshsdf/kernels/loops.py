"""Cut a graph whose vertices all have even degree into simple closed loops."""

from numba import njit


@njit(cache=True, nogil=True)
def trace_loops(segments, start, incident, is_used, place, path, loop_vertices, loop_start):
    """Walk along unused segments; whenever the walk meets itself, cut the loop off.

    segments : (s, 2) vertices 0 .. n-1; start : (n + 1,), incident : (2 s,) segments of vertices;
    is_used : (s,) of False; place : (n,) filled with -1, where a vertex stands in the path;
    path : (s + 1,). Fills loop_vertices (s,) and loop_start (<= s + 1,); returns how many loops.
    """
    n_loops, n_out = 0, 0
    loop_start[0] = 0
    cursor = start[:-1].copy()
    for root in range(len(place)):
        length = 1
        path[0] = root
        place[root] = 0
        while True:
            v = path[length - 1]
            while cursor[v] < start[v + 1] and is_used[incident[cursor[v]]]:
                cursor[v] += 1
            if cursor[v] == start[v + 1]:
                break  # even degrees: only the root can run out of segments
            s = incident[cursor[v]]
            is_used[s] = True
            w = segments[s, 0] + segments[s, 1] - v
            if place[w] < 0:
                place[w] = length
                path[length] = w
                length += 1
                continue
            # Cut off the loop from the first visit of w to here
            for i in range(place[w], length):
                loop_vertices[n_out] = path[i]
                n_out += 1
                if i > place[w]:
                    place[path[i]] = -1
            length = place[w] + 1
            n_loops += 1
            loop_start[n_loops] = n_out
        place[root] = -1
    return n_loops
