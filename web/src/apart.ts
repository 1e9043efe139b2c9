// How far one surface is from another: at each vertex the distance to the nearest point of the other's faces.
import type { Field, Surface3 } from './glb';

/** Faces by the cells of a grid that their boxes meet. */
class Grid {
    private cells = new Map<number, number[]>();
    private low = [Infinity, Infinity, Infinity];
    private counts = [1, 1, 1];
    readonly side: number;
    constructor(private shape: Surface3) {
        const { positions: p, indices } = shape;
        const high = [-Infinity, -Infinity, -Infinity];
        for (let i = 0; i < p.length; i++) {
            this.low[i % 3] = Math.min(this.low[i % 3], p[i]);
            high[i % 3] = Math.max(high[i % 3], p[i]);
        }
        const extent = high.map((h, k) => h - this.low[k]);
        // A surface meets as many cells as there are in its sides: some two faces in each.
        this.side = Math.max(...extent) / Math.max(4, Math.sqrt(indices.length / 36)) || 1;
        this.counts = extent.map((e) => Math.floor(e / this.side) + 1);
        for (let f = 0; f < indices.length; f += 3) {
            const box = [0, 1, 2].map((k) => {
                const at = [0, 1, 2].map((c) => p[3 * indices[f + c] + k]);
                return [this.cell(Math.min(...at), k), this.cell(Math.max(...at), k)];
            });
            this.within(box, (key) => {
                const list = this.cells.get(key);
                if (list) list.push(f);
                else this.cells.set(key, [f]);
            });
        }
    }
    private cell(x: number, k: number): number {
        return Math.max(0, Math.min(this.counts[k] - 1, Math.floor((x - this.low[k]) / this.side)));
    }
    private within(box: number[][], act: (key: number) => void): void {
        for (let x = box[0][0]; x <= box[0][1]; x++)
            for (let y = box[1][0]; y <= box[1][1]; y++)
                for (let z = box[2][0]; z <= box[2][1]; z++) act((x * this.counts[1] + y) * this.counts[2] + z);
    }
    /** The nearest point of the faces to a point, into `to`; and its distance. */
    nearest(point: number[], to: number[]): number {
        const middle = point.map((x, k) => this.cell(x, k));
        const outside = Math.max(...point.map((x, k) => Math.max(this.low[k] - x, x - this.low[k] - this.counts[k] * this.side, 0)));
        let best = Infinity;
        const seen = new Set<number>();
        const most = Math.max(...this.counts);
        for (let ring = 0; ring <= most; ring++) {
            if (best <= (ring - 1) * this.side - outside) break; // whatever comes is farther
            const box = middle.map((c, k) => [Math.max(0, c - ring), Math.min(this.counts[k] - 1, c + ring)]);
            this.within(box, (key) => {
                if (seen.has(key)) return;
                seen.add(key);
                for (const f of this.cells.get(key) ?? []) best = this.nearer(f, point, to, best);
            });
        }
        return best;
    }
    /** Takes the nearest point of one face, if it is nearer than the best so far (Ericson's regions of a triangle). */
    private nearer(f: number, p: number[], to: number[], best: number): number {
        const { positions, indices } = this.shape;
        const [a, b, c] = [0, 1, 2].map((k) => positions.subarray(3 * indices[f + k], 3 * indices[f + k] + 3));
        let d1 = 0, d2 = 0, d3 = 0, d4 = 0, d5 = 0, d6 = 0;
        for (let k = 0; k < 3; k++) {
            const ab = b[k] - a[k], ac = c[k] - a[k];
            d1 += ab * (p[k] - a[k]);
            d2 += ac * (p[k] - a[k]);
            d3 += ab * (p[k] - b[k]);
            d4 += ac * (p[k] - b[k]);
            d5 += ab * (p[k] - c[k]);
            d6 += ac * (p[k] - c[k]);
        }
        const [va, vb, vc] = [d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2];
        let v = 0, w = 0; // shares of b and c
        if (d1 <= 0 && d2 <= 0) v = 0;
        else if (d3 >= 0 && d4 <= d3) v = 1;
        else if (vc <= 0 && d1 >= 0 && d3 <= 0) v = d1 / (d1 - d3);
        else if (d6 >= 0 && d5 <= d6) w = 1;
        else if (vb <= 0 && d2 >= 0 && d6 <= 0) w = d2 / (d2 - d6);
        else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
            w = (d4 - d3) / (d4 - d3 + d5 - d6);
            v = 1 - w;
        } else {
            const sum = va + vb + vc;
            [v, w] = sum > 0 ? [vb / sum, vc / sum] : [0, 0];
        }
        const near = [0, 1, 2].map((k) => a[k] + v * (b[k] - a[k]) + w * (c[k] - a[k]));
        const distance = Math.hypot(near[0] - p[0], near[1] - p[1], near[2] - p[2]);
        if (!(distance < best)) return best;
        to[0] = near[0];
        to[1] = near[1];
        to[2] = near[2];
        return distance;
    }
}

const AT_ONCE = 2000; // vertices, between which the page may answer

/** Of each vertex how far the other surface is, positive where that is outside of this one. */
async function apart(of: Surface3, other: Surface3, unit: string, gone: () => boolean): Promise<Field | undefined> {
    const grid = new Grid(other);
    const count = of.positions.length / 3;
    const values = new Float32Array(count);
    const to = [0, 0, 0];
    for (let i = 0; i < count; i++) {
        if (i % AT_ONCE === 0 && i) {
            await new Promise((yes) => setTimeout(yes, 0));
            if (gone()) return undefined;
        }
        const p = [...of.positions.subarray(3 * i, 3 * i + 3)];
        const distance = grid.nearest(p, to);
        let along = 0;
        for (let k = 0; k < 3; k++) along += (to[k] - p[k]) * of.normals[3 * i + k];
        values[i] = along < 0 ? -distance : distance;
    }
    return { name: 'between', unit, meaning: '', values, low: values.reduce((a, b) => Math.min(a, b), 0), high: values.reduce((a, b) => Math.max(a, b), 0) };
}

/** Of each vertex the area around it, as a share of the whole. */
function sharesOf({ positions: p, indices }: Surface3): Float64Array {
    const area = new Float64Array(p.length / 3);
    for (let f = 0; f < indices.length; f += 3) {
        const [a, b, c] = [3 * indices[f], 3 * indices[f + 1], 3 * indices[f + 2]];
        const u = [0, 1, 2].map((k) => p[b + k] - p[a + k]);
        const v = [0, 1, 2].map((k) => p[c + k] - p[a + k]);
        const third = Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 6;
        for (let k = 0; k < 3; k++) area[indices[f + k]] += third;
    }
    const whole = area.reduce((sum, x) => sum + x, 0) || 1;
    return area.map((x) => x / whole);
}

export interface Apart { field: Field; rms: number; p95: number; max: number }

/** From both sides, as the service tells the fit of an encoding (core/surface/fit.c): root mean square over the areas, the
 *  distance that 95 % are within, the largest. */
export async function bothApart(of: Surface3, other: Surface3, unit: string, gone: () => boolean): Promise<Apart | undefined> {
    const field = await apart(of, other, unit, gone);
    const back = field && await apart(other, of, unit, gone);
    if (!field || !back) return undefined;
    const known = [[of, field], [other, back]] as const;
    const all = known.flatMap(([shape, { values }]) => [...sharesOf(shape)].map((share, i) => ({ share: share / 2, far: Math.abs(values[i]) })));
    all.sort((a, b) => a.far - b.far);
    let weight = 0;
    const p95 = all.find((e) => (weight += e.share) >= 0.95 - 1e-9) ?? all.at(-1)!;
    return { field, rms: Math.sqrt(all.reduce((sum, e) => sum + e.share * e.far ** 2, 0)), p95: p95.far, max: all.at(-1)!.far };
}
