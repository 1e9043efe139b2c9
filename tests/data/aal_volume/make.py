#!/usr/bin/python3
"""Cuts the twelve structures of tests/data/aal_subcortex out of AAL's volume, as NIfTI and NRRD.

    make.py aal.nii.gz      (Debian's mricron-data: /usr/share/mricron/templates/aal.nii.gz)

The affine is moved with the box, so that every voxel stays where it was. Other labels become background.
"""
import gzip
import sys

import nibabel
import numpy

LABELS = {37: 'L_hippocampus', 38: 'R_hippocampus', 41: 'L_amygdala', 42: 'R_amygdala', 71: 'L_caudate',
          72: 'R_caudate', 73: 'L_putamen', 74: 'R_putamen', 75: 'L_pallidum', 76: 'R_pallidum',
          77: 'L_thalamus', 78: 'R_thalamus'}

image = nibabel.load(sys.argv[1])
values = numpy.asarray(image.dataobj).astype(numpy.int16)
values[~numpy.isin(values, list(LABELS))] = 0
where = numpy.argwhere(values)
low, high = where.min(0) - 2, where.max(0) + 3
box = values[tuple(slice(a, b) for a, b in zip(low, high))].astype(numpy.uint8)
affine = image.affine.copy()
affine[:3, 3] = image.affine[:3, :3] @ low + image.affine[:3, 3]
cut = nibabel.Nifti1Image(box, affine)
cut.header.set_xyzt_units('mm')
with open('subcortex.nii.gz', 'wb') as file:
    with gzip.GzipFile('', 'wb', 9, file, mtime=0) as packed:
        packed.write(cut.to_bytes())

lps = numpy.diag([-1, -1, 1]) @ affine[:3]
rows = ['(' + ','.join(f'{x:g}' for x in lps[:, k]) + ')' for k in range(4)]
header = ['NRRD0004', 'type: unsigned char', 'dimension: 3', 'space: left-posterior-superior',
          'sizes: ' + ' '.join(map(str, box.shape)), 'space directions: ' + ' '.join(rows[:3]),
          'kinds: domain domain domain', 'encoding: gzip', 'space origin: ' + rows[3],
          'space units: "mm" "mm" "mm"']
header += [f'Segment{n}_LabelValue:={value}\nSegment{n}_Name:={name}' for n, (value, name) in enumerate(LABELS.items())]
with open('subcortex.seg.nrrd', 'wb') as file:
    file.write(('\n'.join(header) + '\n\n').encode())
    file.write(gzip.compress(box.tobytes(order='F'), 9, mtime=0))
