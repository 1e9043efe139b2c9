"""What `make demo` does, with figures: python3 demo.py [FOLDER OF PLY FILES] [LMAX]

Twelve brain structures are encoded, four of their SRNFs inverted from the unit sphere, and the thalami joined by a
geodesic. The figures go to demo-figures.
"""

import sys
from pathlib import Path

import numpy as np

import srnf
from srnf.figures import draw_surfaces

files = sorted(Path(sys.argv[1] if len(sys.argv) > 1 else "tests/data/aal_subcortex").glob("*.ply"))
lmax, out, client = int(sys.argv[2]) if len(sys.argv) > 2 else 31, Path("demo-figures"), srnf.Client()
meshes = client.upload_all(files)
encoded = client.map("encode", [{"mesh": mesh, "lmax": lmax} for mesh in meshes])
for mesh, one in zip(meshes, encoded):
    fit = 100 * one.fit.relativeToDiagonal.rms
    print(f"{mesh.name:14} {mesh.faces:6} faces, volume {mesh.report.volume:6.0f}, fit {fit:.3f} % of the diagonal")
surfaces = {mesh.name: one.surface for mesh, one in zip(meshes, encoded)}
for name in ("L_thalamus", "R_thalamus", "L_pallidum", "R_pallidum"):
    found = client.invert(surfaces[name], initial="sphere")
    error = np.linalg.norm((found.surface.coefficients() - surfaces[name].coefficients())[:, 1:])
    print(f"{name:14} inverted: relative energy {found.relativeEnergy:.1e}, surface error {error:.1e}")
path = client.geodesic(surfaces["L_thalamus"], surfaces["R_thalamus"], steps=7, register=False)
print(f"geodesic between the thalami: distance {path.distance:.4f}, length {path.length:.4f}")
out.mkdir(exist_ok=True)
draw_surfaces(list(surfaces.values()), list(surfaces)).savefig(out / "members.png")
titles = [f"t = {t:.2f}" for t in path.times]
draw_surfaces(path.surfaces, titles, "deformation", columns=7).savefig(out / "geodesic.png")
