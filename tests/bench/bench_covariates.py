#!/usr/bin/python3
"""Ventricles by their clinical indices, over HTTP: does a predicted surface have the sphericity that was asked for?

    tests/bench/bench_covariates.py URL DATA [LMAX]

URL is that of a server; DATA has the folder lv_endocardium_ed with labels.csv. The formula is shape ~ Sphericity + EF +
group, and points are the 5th, 50th and 95th percentile of Sphericity at the mean of EF, in both groups. Sphericity is the
volume, as a percentage of the ball whose diameter is the long axis. The column's own axis ends at the valve and not at the
surface's farthest point, so what is measured on surfaces is brought to its scale by a line through all members first; the
members' own deviation from that line is told beside.
"""
import csv
import json
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "clients/python/src"))
import srnf  # noqa: E402

PERCENTILES = (5, 50, 95)


def measure(client, surface):
    rows = [row.split() for row in client.get(f"/v1/surfaces/{surface}/mesh", format="obj").decode().splitlines()]
    vertices = np.array([row[1:4] for row in rows if row[:1] == ["v"]], float)
    faces = np.array([[word.split("/")[0] for word in row[1:4]] for row in rows if row[:1] == ["f"]], int) - 1
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = abs(np.einsum("ij,ij", a, np.cross(b, c))) / 6
    axis = max(np.linalg.norm(vertices - v, axis=1).max() for v in vertices[::5])
    return 100 * volume / (np.pi / 6 * axis**3)


def main(url, data, lmax=15):
    client = srnf.Client(url)
    folder = pathlib.Path(data) / "lv_endocardium_ed"
    rows = list(csv.DictReader(open(folder / "labels.csv", encoding="utf-8")))
    members = [{"id": client.encode(client.upload(folder / row["file"]), lmax=int(lmax)).surface.id, "subject": row["file"],
                "label": row["group"], "covariates": {name: float(row[name]) for name in ("Sphericity", "EF")}}
               for row in rows]
    column = np.array([float(row["Sphericity"]) for row in rows])
    own = np.array([measure(client, member["id"]) for member in members])
    line = np.polyfit(own, column, 1)
    print("members", json.dumps({"n": len(rows), "correlation": np.corrcoef(own, column)[0, 1],
                                 "deviation": float(np.std(column - np.polyval(line, own)))}))
    asked = np.percentile(column, PERCENTILES)
    ef = float(np.mean([float(row["EF"]) for row in rows]))
    groups = sorted({row["group"] for row in rows})
    at = [{"Sphericity": float(value), "EF": ef, "label": group} for group in groups for value in asked]
    found = client.regress(client.cohort("indices", members), "shape ~ Sphericity + EF + label", at=at,
                           permutations=999).raw
    for term in found["terms"]:
        print("term", json.dumps({k: term[k] for k in ("name", "pValue", "r2", "r2Interval", "partialR2")}))
    for one in found["predictions"]:
        print("predicted", json.dumps({"at": one["at"], "relativeEnergy": one["relativeEnergy"],
                                       "measured": float(np.polyval(line, measure(client, one["surface"]["id"])))}))


main(*sys.argv[1:])
