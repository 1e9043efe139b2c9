"""A new subject beside a study: python3 new_subject.py FOLDER LABELS MESH [LMAX]

Scores of the new mesh in the model of the study, and whether it belongs there at all.
"""

import sys

import srnf
from srnf.figures import draw_scores, draw_surfaces

lmax = int(sys.argv[4]) if len(sys.argv) > 4 else None
study = srnf.Study.from_folder(sys.argv[1], sys.argv[2], lmax=lmax, register="template", degree=4)
model = study.model()
found = study.project(sys.argv[3])
print("scores:", (found.scores / model.eigenvalues**0.5).round(2)[:3], "standard deviations")
print(f"residual {found.residual:.3f}, distance to the mean {found.distance:.3f}")
for warning in found.warnings:
    print("doubt:", warning)
matrix = study.client.distances([*study.register(), found.inputs.surface], register=False).matrix[-1, :-1]
nearest = matrix.argsort()[:3]
print("nearest:", ", ".join(f"{study.names()[i]} ({study.members[i].label}, {matrix[i]:.3f})" for i in nearest))
groups = [member.label for member in study.members]
draw_scores(model.scores(), groups, model.explained, found.scores).savefig(study.out / "new-subject.png")
shown = [study.client.surface(found.inputs.surface), study.register()[nearest[0]]]
draw_surfaces(shown, ["new", study.names()[nearest[0]]]).savefig(study.out / "new-and-nearest.png")
