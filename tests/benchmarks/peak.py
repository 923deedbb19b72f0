"""The peak memory of a process, for scripts that are run by their path."""


def peak_bytes() -> int:
    """The most memory this process has held since its program began, in bytes.

    ``ru_maxrss`` would include what the parent held when it forked.
    """
    with open("/proc/self/status") as file:
        for line in file:
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    raise OSError("/proc/self/status does not tell the peak")
