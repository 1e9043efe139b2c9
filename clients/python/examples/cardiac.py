"""A study of hearts at the end of diastole (time 0) and systole (time 1): python3 cardiac.py FOLDER LABELS [LMAX]

The meshes share a pose and a unit. Groups are compared at diastole; contractions are compared by what they make of the
mean heart.
"""

import sys

import srnf
from srnf.figures import draw_surfaces

lmax = int(sys.argv[3]) if len(sys.argv) > 3 else None
study = srnf.Study.from_folder(sys.argv[1], sys.argv[2], lmax=lmax, register="template", degree=4, common_pose=True)
heart = {(m.subject, m.time): s for m, s in zip(study.members, study.register())}
volume = {key: surface.volume * surface.scale**3 for key, surface in heart.items()}
diastole = study.subset("diastole", lambda member: member.time == 0)
for member in diastole.members:
    member.covariates["ejection"] = 1 - volume[member.subject, 1] / volume[member.subject, 0]
    print(f"{member.subject} ({member.label}): ejects {100 * member.covariates['ejection']:.0f} %")
diastole.run(permutations=999, method="srnf-nn", steps=("encode", "pca", "modes", "groups", "classify"))
print(f"shape at diastole: p = {diastole.compare_groups(permutations=999).p_value:.3g}")
first = [next(m.subject for m in diastole.members if m.label == label) for label in diastole.labels()]
mean = diastole.model().mean
moved = [study.client.transfer(heart[s, 0], heart[s, 1], mean, register=False).surface for s in first]
draw_surfaces([mean, *moved], ["mean", *first], "deformation").savefig(diastole.out / "contraction.png")
path = study.client.geodesic(heart[first[0], 0], heart[first[0], 1], register=False)
for k, surface in enumerate(path.surfaces):
    surface.save(diastole.out / f"beat-{k}.glb", space="original")
print(diastole.report())
