"""Draco on the same cloud as the chunk codec: bytes a point and CPU seconds, at equal position error.

    python draco_compare.py cloud.ply [--voxel METRES] [--runs 3]

Reads a `cloud.ply` in Semascan's layout and codes position, colour and label with Draco's kd-tree coder (DracoPy).
Colour and label travel as four one-component generic attributes: with one three-component attribute the kd-tree
coder's time grows faster than the number of points. Positions are snapped to a cubic grid of voxel/14 first, which is
the chunk codec's own quantum, and Draco is asked for exactly that grid, so both make the same error (at most
sqrt(3)/2 of a quantum). One JSON object goes to stdout. Needs numpy and DracoPy.
"""

import argparse
import json
import re
import sys
import time

import DracoPy
import numpy as np

QUANTA_PER_VOXEL = 14
PLY_TYPES = {
    "float": "<f4", "double": "<f8", "uchar": "u1", "ushort": "<u2", "uint": "<u4", "char": "i1", "short": "<i2", "int": "<i4",
}


def read_cloud(path):
    """The vertices of a binary little-endian PLY as a structured array, and the voxel edge if a comment notes it."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode()
    if "format binary_little_endian 1.0" not in header:
        raise SystemExit(f"{path}: not a binary little-endian PLY")
    count = int(re.search(r"element vertex (\d+)", header)[1])
    layout = np.dtype([(name, PLY_TYPES[kind]) for kind, name in re.findall(r"property (\w+) (\w+)", header)])
    noted = re.search(r"comment voxel (\S+)", header)
    return np.frombuffer(data, layout, count, end), float(noted[1]) if noted else None


def encode(quanta, bits, columns, level):
    """One Draco buffer: integer positions on a grid of 2^bits - 1 steps, and one-component attributes."""
    return DracoPy.encode(
        quanta,
        quantization_bits=bits,
        quantization_range=float((1 << bits) - 1),
        quantization_origin=[0.0, 0.0, 0.0],
        compression_level=level,
        generic_attributes=columns,
    )


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("cloud")
    arguments.add_argument("--voxel", type=float, help="voxel edge in metres, where the cloud does not note it")
    arguments.add_argument("--runs", type=int, default=3)
    arguments.add_argument("--level", type=int, default=7, help="Draco's compression level, 0..10")
    options = arguments.parse_args()

    cloud, noted = read_cloud(options.cloud)
    voxel = options.voxel or noted
    if not voxel:
        raise SystemExit(f"{options.cloud}: no `comment voxel METRES`; say --voxel")
    positions = np.stack([cloud["x"], cloud["y"], cloud["z"]], axis=1).astype(np.float64)
    quantum = voxel / QUANTA_PER_VOXEL
    lowest = np.floor(positions.min(axis=0) / quantum)
    quanta = np.floor(positions / quantum) - lowest
    bits = int(np.ceil(np.log2(quanta.max() + 1)))
    quanta = quanta.astype(np.float32)
    columns = {
        name: np.ascontiguousarray(cloud[name].reshape(-1, 1).astype(kind))
        for name, kind in (("red", np.uint8), ("green", np.uint8), ("blue", np.uint8), ("label", np.uint16))
    }

    seconds = []
    for _ in range(options.runs):
        start = time.process_time()
        packed = encode(quanta, bits, columns, options.level)
        seconds.append(time.process_time() - start)
    start = time.process_time()
    unpacked = DracoPy.decode(packed)
    decode_seconds = time.process_time() - start

    # The same multiset of points must come back, or the comparison is void.
    def ordered(points):
        return points[np.lexsort(np.rint(points).astype(np.int64).T)]

    error = float(np.abs(ordered(np.asarray(unpacked.points)) - ordered(quanta)).max())
    if error > 0.01:
        raise SystemExit(f"Draco moved points by {error} quanta: not at equal position error")
    json.dump(
        {
            "coder": "draco",
            "points": len(cloud),
            "voxel_m": voxel,
            "position_bits": bits,
            "compression_level": options.level,
            "bytes_per_point": len(packed) / len(cloud),
            "encode_cpu_s": min(seconds),
            "encode_mpoints_per_s": len(cloud) / min(seconds) / 1e6,
            "decode_cpu_s": decode_seconds,
        },
        sys.stdout,
    )
    print()


if __name__ == "__main__":
    main()
