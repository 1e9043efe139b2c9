// samples.cjs - content that the fuzzer starts from: small closed meshes in text formats, arrays as .npy,
// surfaces and cohorts as JSON, small enough that what is computed from them takes no time.
'use strict';

const PHI = (1 + Math.sqrt(5)) / 2;

// An icosahedron, stretched along z, as vertices and faces turned outwards.
function icosahedron(stretch) {
    const vertices = [];
    for (const [i, j] of [[-1, PHI], [1, PHI], [-1, -PHI], [1, -PHI]]) {
        vertices.push([i, j, 0]);
    }
    for (const [i, j] of [[-1, PHI], [1, PHI], [-1, -PHI], [1, -PHI]]) {
        vertices.push([0, i, j]);
    }
    for (const [i, j] of [[PHI, -1], [PHI, 1], [-PHI, -1], [-PHI, 1]]) {
        vertices.push([i, 0, j]);
    }
    const faces = [
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
        [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
        [8, 6, 7], [9, 8, 1],
    ];
    return { vertices: vertices.map(([x, y, z]) => [x, y, z * stretch]), faces };
}

function off({ vertices, faces }) {
    const lines = ['OFF', `${vertices.length} ${faces.length} 0`];
    lines.push(...vertices.map((v) => v.join(' ')), ...faces.map((f) => `3 ${f.join(' ')}`));
    return Buffer.from(lines.join('\n') + '\n');
}

function obj({ vertices, faces }) {
    const lines = vertices.map((v) => `v ${v.join(' ')}`);
    lines.push(...faces.map((f) => `f ${f.map((i) => i + 1).join(' ')}`));
    return Buffer.from(lines.join('\n') + '\n');
}

function ply({ vertices, faces }) {
    const lines = ['ply', 'format ascii 1.0', `element vertex ${vertices.length}`];
    lines.push('property float x', 'property float y', 'property float z', `element face ${faces.length}`);
    lines.push('property list uchar int vertex_indices', 'end_header');
    lines.push(...vertices.map((v) => v.join(' ')), ...faces.map((f) => `3 ${f.join(' ')}`));
    return Buffer.from(lines.join('\n') + '\n');
}

// An ellipsoid on an equiangular grid of nTheta by nPhi nodes, poles included, as [x, y, z, x, ...].
function ellipsoid(nTheta, nPhi, stretch) {
    const values = [];
    for (let i = 0; i < nTheta; i++) {
        const theta = (Math.PI * i) / (nTheta - 1);
        for (let j = 0; j < nPhi; j++) {
            const phi = (2 * Math.PI * j) / nPhi;
            values.push(Math.sin(theta) * Math.cos(phi), Math.sin(theta) * Math.sin(phi), stretch * Math.cos(theta));
        }
    }
    return values;
}

function npy(shape, values) {
    let head = `{'descr': '<f8', 'fortran_order': False, 'shape': (${shape.join(', ')}), }`;
    head = head.padEnd(64 * Math.ceil((head.length + 11) / 64) - 11) + '\n';
    const prefix = Buffer.alloc(10);
    prefix.write('\x93NUMPY\x01\x00', 'latin1');
    prefix.writeUInt16LE(head.length, 8);
    return Buffer.concat([prefix, Buffer.from(head), Buffer.from(Float64Array.from(values).buffer)]);
}

function surfaceJson(stretch) {
    const grid = { kind: 'equiangular', nTheta: 9, nPhi: 9, xyz: ellipsoid(9, 9, stretch) };
    return { grid, lmax: 4, name: `ellipsoid ${stretch}` };
}

module.exports = {
    meshes: [off(icosahedron(1)), obj(icosahedron(1.5)), ply(icosahedron(0.7)), off(icosahedron(1.2))],
    npy: [npy([9, 9, 3], ellipsoid(9, 9, 1.1)), npy([11, 12, 3], ellipsoid(11, 12, 0.8))],
    surfaces: [1, 1.3, 0.8, 1.6].map(surfaceJson),
};
