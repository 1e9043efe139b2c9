// Normals and bounds of shapes whose vertices moved, and shapes between others.
import type { Surface3 } from './glb';

/** Of the corners, weighted by the area of their faces; in place. */
export function normalsOf(shape: Surface3): void {
    const { positions: p, indices, normals } = shape;
    normals.fill(0);
    for (let f = 0; f < indices.length; f += 3) {
        const [a, b, c] = [3 * indices[f], 3 * indices[f + 1], 3 * indices[f + 2]];
        const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
        const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
        const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
        for (const i of [a, b, c]) for (let k = 0; k < 3; k++) normals[i + k] += n[k];
    }
    for (let i = 0; i < normals.length; i += 3) {
        const length = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
        for (let k = 0; k < 3; k++) normals[i + k] /= length;
    }
}

export function boundsOf(shapes: Surface3[]): { centre: [number, number, number]; radius: number } {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (const { positions } of shapes)
        for (let i = 0; i < positions.length; i++) {
            const k = i % 3;
            if (positions[i] < low[k]) low[k] = positions[i];
            if (positions[i] > high[k]) high[k] = positions[i];
        }
    const centre = low.map((l, k) => (l + high[k]) / 2) as [number, number, number];
    let radius = 0;
    for (const { positions } of shapes)
        for (let i = 0; i < positions.length; i += 3)
            radius = Math.max(radius, Math.hypot(positions[i] - centre[0], positions[i + 1] - centre[1], positions[i + 2] - centre[2]));
    return { centre, radius: radius || 1 };
}

/** A shape of its own, which others of the same faces are blended into. */
export const copyOf = (like: Surface3): Surface3 => ({
    ...like, positions: like.positions.slice(), normals: like.normals.slice(), fields: like.fields.map((f) => ({ ...f, values: f.values.slice() })),
});

/** Shares of values at given places (rising) for a place between or beyond them: a polynomial through the four nearest. */
export function between(places: number[], at: number): [number, number][] {
    const many = Math.min(4, places.length);
    const after = places.findIndex((p) => p >= at);
    const first = Math.max(0, Math.min(places.length - many, (after < 0 ? places.length : after) - (many >> 1)));
    return Array.from({ length: many }, (_, k) => {
        let w = 1;
        for (let j = 0; j < many; j++) if (j !== k) w *= (at - places[first + j]) / (places[first + k] - places[first + j]);
        return [first + k, w];
    });
}

/** Positions, normals and maps of shapes in these shares. Maps are matched by their names. */
export function blend(to: Surface3, from: Surface3[], shares: [number, number][]): void {
    to.positions.fill(0);
    for (const [k, w] of shares) {
        const { positions } = from[k];
        for (let i = 0; i < positions.length; i++) to.positions[i] += w * positions[i];
    }
    for (const field of to.fields) {
        field.values.fill(0);
        for (const [k, w] of shares) {
            const values = from[k].fields.find((f) => f.name === field.name)?.values;
            for (let i = 0; values && i < values.length; i++) field.values[i] += w * values[i];
        }
    }
    normalsOf(to);
}
