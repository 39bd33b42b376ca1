"""Runs a program and says what it cost: small, since a child's peak memory begins with its parent's.

usage: measured.py TIMEOUT_S TOLD.json PROGRAM ARGUMENT ...
"""

import json
import os
import sys
import time


def main():
    timeout, told = float(sys.argv[1]), sys.argv[2]
    began = time.perf_counter()
    child = os.posix_spawnp(sys.argv[3], sys.argv[3:], os.environ)
    code = None
    while code is None:
        pid, status, usage = os.wait4(child, os.WNOHANG)
        if pid:
            code = os.waitstatus_to_exitcode(status)
        elif time.perf_counter() - began > timeout:
            os.kill(child, 9)
            _, _, usage = os.wait4(child, 0)
            code = 124
        else:
            time.sleep(0.002)
    with open(told, "w", encoding="ascii") as file:
        json.dump(
            {
                "code": code,
                "seconds": time.perf_counter() - began,
                "processor_s": usage.ru_utime + usage.ru_stime,
                "peak_mib": usage.ru_maxrss / 1024,
            },
            file,
        )


if __name__ == "__main__":
    main()
