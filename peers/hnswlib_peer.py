"""hnswlib beside the other libraries: `peers --export DIR --hnswlib PYTHON` runs it.

    pip install hnswlib numpy

Finds the smallest ef that reaches the recall (core's), and says so by a line. For each line of its input it then answers
every query once and prints a line; at the end of its input it prints its row of the table. All queries of a class go to
the library in one call on one thread, which spares it Python's share; the quickest round of each class counts.
"""

import argparse
import json
import pathlib
import sys
import time

import hnswlib
import numpy as np

BREADTHS = [8, 10, 12, 16, 20, 24, 32, 40, 44, 48, 56, 64, 72, 80, 96, 112, 128, 160, 192, 256, 384, 512, 1024]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--recall", type=float, default=0.985, help="recall to reach")
    arguments = parser.parse_args()
    points, of_class, ks, queries = (
        np.load(arguments.folder / f"{name}.npy") for name in ["points", "class", "k", "queries"]
    )
    classes = []
    for number, k in enumerate(ks.astype(int)):
        mine = points[of_class == number]
        if k == 0 or len(mine) == 0:
            continue
        index = hnswlib.Index(space="l2", dim=points.shape[1])
        index.init_index(max_elements=len(mine), ef_construction=128, M=16, random_seed=1)
        index.add_items(mine, num_threads=1)
        index.set_num_threads(1)
        exact = ((queries**2).sum(1)[:, None] - 2.0 * queries @ mine.T) + (mine**2).sum(1)
        nearest = np.argpartition(exact, k - 1, axis=1)[:, :k]
        distance = ((queries[:, None] - mine[nearest]) ** 2).sum(2)
        classes.append((index, k, mine, distance.max(1) * (1 + 1e-5)))
    recall = 0.0
    for ef in BREADTHS:
        hits = wanted = 0
        for index, k, mine, radius in classes:
            index.set_ef(max(ef, k))
            found, _ = index.knn_query(queries, k=k, num_threads=1)
            distance = ((queries[:, None] - mine[found.astype(int)]) ** 2).sum(2)
            hits += np.minimum((distance <= radius[:, None]).sum(1), k).sum() / k
            wanted += len(queries)
        recall = hits / wanted
        if recall >= arguments.recall:
            break
    best = np.full(len(classes), np.inf)
    print("ready", flush=True)
    for _ in sys.stdin:
        for at, (index, k, _, _) in enumerate(classes):
            start = time.perf_counter()
            index.knn_query(queries, k=k, num_threads=1)
            best[at] = min(best[at], time.perf_counter() - start)
        print("done", flush=True)
    us = best.sum() * 1e6 / (len(classes) * len(queries))
    row = {"method": "hnswlib", "recall": round(float(recall), 4), "us_per_query": round(float(us), 3), "ef": ef, "visits": None}
    print(json.dumps(row))


if __name__ == "__main__":
    main()
