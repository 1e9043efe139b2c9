"""A study of brain nuclei: python3 brain.py FOLDER LABELS [LMAX]

The table has file, label, subject, side and age. Right sides are mirrored, and all are laid on the first member once,
which is quick; leave out `register` and `degree` for a registration of everything to the mean.
"""

import sys

import srnf

lmax = int(sys.argv[3]) if len(sys.argv) > 3 else None
study = srnf.Study.from_folder(
    sys.argv[1], sys.argv[2], lmax=lmax, mirror_right=True, register="template", degree=4, skip_refused=True
)
for member, surface in zip(study.members, study.encode()):
    print(f"{member.path.name:24} fit {100 * surface.fit.relativeToDiagonal.rms:.2f} % of the diagonal")
print("components:", study.pca().model.cumulative.round(2), "converged:", study.pca().converged)
test = study.compare_groups(permutations=999)
print(f"groups {test.groups}: p = {test.p_value:.3g}, in {test.pValueInterval}, smallest possible: {test.pValueIsFloor}")
adjusted = study.compare_groups(permutations=99, covariates=["age"])
print(f"without the effect of {adjusted.regressedOut}: p = {adjusted.p_value:.3g}")
for name, method in study.classify(["harmonic-nn", "spharm-pdm"]).methods.items():
    print(f"{name}: {100 * method.accuracy:.0f} % right, interval {method.confidenceInterval.round(2)}")
for warning in study.warnings():
    print("doubt:", warning["where"], warning["detail"])
study.modes(1)
study.tables()
print(study.report())
