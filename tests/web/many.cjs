// Many meshes with a table of two groups: spheres with bumps that follow no rule, of which half are longer.
'use strict';
const fs = require('fs');
const path = require('path');

/** The octahedron with each edge cut in n parts, on the unit sphere: vertices and faces. */
function octahedron(n) {
    const vertices = [];
    const known = new Map();
    const at = (x, y, z) => {
        const key = `${x} ${y} ${z}`;
        if (!known.has(key)) known.set(key, vertices.push([x, y, z].map((v) => v / Math.hypot(x, y, z))) - 1);
        return known.get(key);
    };
    const faces = [];
    for (const [a, b, c] of [[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1], [1, 1, -1], [-1, 1, -1], [-1, -1, -1], [1, -1, -1]]) {
        const turned = a * b * c < 0;
        const put = (p, q, r) => faces.push(turned ? [p, r, q] : [p, q, r]);
        const corner = (i, j) => at(a * (n - i - j), b * i, c * j);
        for (let i = 0; i < n; i++)
            for (let j = 0; i + j < n; j++) {
                put(corner(i, j), corner(i + 1, j), corner(i, j + 1));
                if (i + j < n - 1) put(corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
            }
    }
    return { vertices, faces };
}

function write(folder, count) {
    fs.mkdirSync(folder, { recursive: true });
    const { vertices, faces } = octahedron(8);
    const rows = ['file,label'];
    const files = Array.from({ length: count }, (_, i) => {
        const long = i % 2 === 1;
        const points = vertices.map(([x, y, z]) => {
            const r = 1 + 0.05 * Math.sin(1.7 * i + 3 * x) + 0.05 * Math.sin(2.3 * i + 4 * y) + 0.04 * Math.sin(0.9 * i + 5 * z);
            return [r * x, 0.9 * r * y, (long ? 1.35 : 1.2) * r * z].map((v) => v.toFixed(5)).join(' ');
        });
        const file = path.join(folder, `shape-${i}.off`);
        fs.writeFileSync(file, `OFF\n${vertices.length} ${faces.length} 0\n${points.join('\n')}\n${faces.map((f) => `3 ${f.join(' ')}`).join('\n')}\n`);
        rows.push(`shape-${i}.off,${long ? 'long' : 'round'}`);
        return file;
    });
    const table = path.join(folder, 'twohundred.csv');
    fs.writeFileSync(table, `${rows.join('\n')}\n`);
    return { files, table };
}
module.exports = { write };
