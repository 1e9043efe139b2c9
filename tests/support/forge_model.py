#!/usr/bin/env python3
"""forge_model.py IN.zip OUT.zip WHAT [PATTERN BY] - the zip of a model with one thing changed, under the id that follows.

WHAT is record (no object), infinite (a number of the mean field), huge (a score), downward (an eigenvalue), negative (a
calibrated norm), parts (which the numbers do not fit), mean (a surface that nobody has), degree (that of the model), alone
(the model without its surfaces), replace (the first match of a regular expression in the record, by another text) or
everywhere (all matches). An id is a hash that anybody can make, and so are the digests of the manifest.
"""

import hashlib
import io
import json
import re
import struct
import sys
import zipfile

ARRAYS = ["mean_q.npy", "modes.npy", "eigenvalues.npy", "scores.npy", "calibration.npy"]

NUMBERS = {
    "infinite": ("mean_q.npy", float("inf")),
    "huge": ("scores.npy", -1e308),
    "downward": ("eigenvalues.npy", -1.0),
    "negative": ("calibration.npy", -1.0),
}


def main(source, target, what, pattern="", by=""):
    with zipfile.ZipFile(source) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    study = json.loads(files["srnfd-study.json"])
    model = study["models"][0]
    with zipfile.ZipFile(io.BytesIO(files.pop(model["file"]))) as archive:
        arrays = {name: bytearray(archive.read(name)) for name in ARRAYS if name in archive.namelist()}
    if what in ("replace", "everywhere"):
        model["record"], count = re.subn(pattern, by, model["record"], count=int(what == "replace"))
        assert count > 0, "nothing matches " + pattern
    identity = re.sub(r'"job":"job-[0-9a-f-]*",', "", model["record"])
    if what == "record":
        model["record"], identity = "null", ""
    elif what in NUMBERS:
        array, value = NUMBERS[what]
        arrays[array][-8:] = struct.pack("<d", value)
    elif what == "parts":
        model["record"] = identity = '{"parts":[null,null]}'
    elif what == "degree":
        model["lmax"] += 1
    elif what == "mean":
        model["mean"] = "surf-" + 32 * "0"
    elif what == "alone":
        study.update(surfaces=[], meshes=[], jobs=[])
    numbers = [model[name] for name in ("lmax", "nTheta", "nPhi", "subjects", "components")]
    whole = hashlib.sha256(struct.pack("<5q", *numbers) + model["mean"].encode())
    for array in arrays.values():
        whole.update(array[10 + struct.unpack("<H", array[8:10])[0] :])
    whole.update(identity.encode())
    model["id"] = "model-" + whole.hexdigest()[:32]
    model["file"] = "models/" + model["id"] + ".npz"
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, array in arrays.items():
            archive.writestr(name, bytes(array))
    study["files"][model["file"]] = hashlib.sha256(packed.getvalue()).hexdigest()
    listed = {one["file"] for kind in ("meshes", "surfaces", "jobs") for one in study[kind]}
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("srnfd-study.json", json.dumps(study))
        for name, content in files.items():
            if name in listed:
                archive.writestr(name, content)
        archive.writestr(model["file"], packed.getvalue())
    print(model["id"])


if __name__ == "__main__":
    main(*sys.argv[1:])
