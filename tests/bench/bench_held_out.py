#!/usr/bin/python3
"""Ventricles that models have not seen, over HTTP: what train, predict, score and change say of them.

    tests/bench/bench_held_out.py URL DATA [LMAX]

URL is that of a server; DATA has the folders lv_endocardium_ed (with labels.csv) and lv_pairs. Nothing is printed of single
members but the lengths of their changes.

change: the ten ventricles at end diastole and end systole. train, predict: a classifier of every other ventricle of each
group, asked about the rest, and the other way round: accuracy, area under the curve and Brier score, nested and tested,
and the calibration of the tested. score: models of every other normal ventricle, asked about the other normal ones and
half of the infarcted: Kolmogorov and Smirnov's test that percentiles are uniform, deciles and median.
"""
import csv
import json
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "clients/python/src"))
import srnf  # noqa: E402

TOLD = ("accuracy", "balancedAccuracy", "auc", "brier", "brierReference", "logLoss")
RANKS = ("overall", "mahalanobis", "residual")


def say(what, figures):
    print(what, json.dumps(figures), flush=True)


def uniform(percentiles):
    """Distance from the uniform distribution, and its asymptotic p."""
    x = np.sort(percentiles) / 100
    n = len(x)
    i = np.arange(1, n + 1)
    d = max(np.max(i / n - x), np.max(x - (i - 1) / n))
    t = d * (np.sqrt(n) + 0.12 + 0.11 / np.sqrt(n))
    return float(d), float(min(1, 2 * sum((-1) ** (k - 1) * np.exp(-2 * k * k * t * t) for k in range(1, 101))))


def tell_change(client, encode, ids, folder):
    members = []
    for path in sorted(folder.glob("lv_*_es_endo.ply")):
        subject = path.name[: -len("_es_endo.ply")]
        members += [{"id": ids[subject + ".ply"].id, "subject": subject, "time": 0},
                    {"id": encode(path).id, "subject": subject, "time": 1}]
    found = client.change(client.cohort("beats", members), permutations=9999).raw
    say("change", {k: found[k] for k in ("subjects", "change", "share", "pValue", "relabellings", "leastSignificance",
                                         "leastFdr", "largestEffect")})
    say("  lengths", [(one["subject"], round(one["length"], 2)) for one in found["perSubject"]])


def tell_prediction(client, ids, groups):
    halves = []
    for k in (0, 1):
        rows = [row for label in ("0", "1") for row in groups[label][k::2]]
        halves.append(client.cohort(f"half{k}", [
            {"id": ids[row["file"]].id, "label": "mi" if row["label"] == "1" else "normal", "subject": row["file"]}
            for row in rows]))
    for method in ("srnf-gauss", "srnf-nn"):
        for k in (0, 1):
            trained = client.train(halves[k], method=method)
            nested = trained.raw["validation"]
            tested = client.predict(trained.raw["model"]["id"], halves[1 - k]).raw["assessment"]
            low, high = nested["accuracy"]["interval"]
            say(f"{method}, trained on half {k}", {
                "nested": {name: nested[name] for name in TOLD}, "tested": {name: tested[name] for name in TOLD},
                "inside": low <= tested["accuracy"]["value"] <= high,
                "calibration": [(round(b["meanProbability"], 3), round(b["observed"], 3), b["members"])
                                for b in tested["calibration"]["mi"] if b["members"]]})


def tell_scores(client, ids, groups):
    found = {"normal": [], "mi": []}
    for k in (0, 1):
        model = client.pca([ids[row["file"]] for row in groups["0"][k::2]]).model
        for name, rows in (("normal", groups["0"][1 - k::2]), ("mi", groups["1"][k::2])):
            for row in rows:
                told = client.score(model, ids[row["file"]]).raw
                found[name].append([told["percentile"], *(told["ranks"][rank]["percentile"] for rank in RANKS[1:])])
    for name, ranks in found.items():
        for which, percentiles in zip(RANKS, np.array(ranks).T):
            say(f"score, {name}, {which}", {
                "n": len(percentiles), "uniform": uniform(percentiles), "median": float(np.median(percentiles)),
                "deciles": np.histogram(percentiles, 10, (0, 100))[0].tolist()})


def main(url, data, lmax=10):
    client = srnf.Client(url)
    folder = pathlib.Path(data) / "lv_endocardium_ed"
    rows = list(csv.DictReader(open(folder / "labels.csv", encoding="utf-8")))

    def encode(path):
        return client.encode(client.upload(path), lmax=int(lmax)).surface

    ids = {row["file"]: encode(folder / row["file"]) for row in rows}
    groups = {label: [row for row in rows if row["label"] == label] for label in ("0", "1")}
    tell_change(client, encode, ids, pathlib.Path(data) / "lv_pairs")
    tell_prediction(client, ids, groups)
    tell_scores(client, ids, groups)


main(*sys.argv[1:])
