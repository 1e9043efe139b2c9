// Shapes at points of covariates, as linear models predict them: along which covariate they can be followed, and which of
// them belong to one line. The same on the page and in a report.
import { between } from './geometry';
import type { Surface3 } from './glb';
import { figure } from './text';

export type Point = Record<string, unknown>;

const isNumber = (v: unknown): v is number => typeof v === 'number';
const differ = (points: Point[], name: string): boolean => new Set(points.map((p) => p[name])).size > 1;

export const textOfPoint = (at: Point): string => Object.entries(at).map(([name, v]) => `${name} ${isNumber(v) ? figure(v) : v}`).join(', ');

/** Covariates that are numbers and differ, time before the others. */
export function axesOf(points: Point[]): string[] {
    const names = [...new Set(points.flatMap((p) => Object.keys(p)))];
    const axes = names.filter((name) => points.every((p) => isNumber(p[name])) && differ(points, name));
    return axes.sort((a, b) => Number(b === 'time') - Number(a === 'time'));
}

export interface Line { text: string; members: number[]; places: number[] }

/** Points that differ along the axis alone, in its order; what the lines differ by is their text. */
export function linesOf(points: Point[], axis: string): Line[] {
    const lines = new Map<string, Line>();
    points.forEach((point, i) => {
        const rest = Object.fromEntries(Object.entries(point).filter(([name]) => name !== axis && differ(points, name)));
        const key = JSON.stringify(Object.entries(rest).sort());
        if (!lines.has(key)) lines.set(key, { text: textOfPoint(rest), members: [], places: [] });
        lines.get(key)!.members.push(i);
    });
    for (const line of lines.values()) {
        const at = (i: number) => points[i][axis] as number;
        line.members = line.members.sort((a, b) => at(a) - at(b)).filter((i, k, all) => k === 0 || at(i) > at(all[k - 1]));
        line.places = line.members.map(at);
    }
    return [...lines.values()];
}

/** What all points have in common. */
export const commonOf = (points: Point[]): Point => Object.fromEntries(Object.entries(points[0] ?? {}).filter(([name]) => !differ(points, name)));

// ---- Several structures together -------------------------------------------------------------------------------------

interface Joint {
    parts: { name: string; mean: { scale: number } }[]; eigenvalues: number[];
    /** How components move them is known of results, not of models. */
    positions: { mean: number[][]; components?: number[][][] } | null;
}

/** Sizes of the parts beside each other: those of the subjects' mean, whose total area is one. */
export function sizesOf(result: Joint): number[] {
    const all = Math.hypot(...result.parts.map((p) => p.mean.scale));
    return result.parts.map((p) => p.mean.scale / all);
}

/** Where the middle of each part is at these standard deviations; side by side where the model has no positions. */
export function middlesOf(result: Joint, radii: number[], at: Record<number, number>): number[][] {
    const sizes = sizesOf(result);
    let right = 0;
    return result.parts.map((_, p) => {
        if (result.positions) {
            const { mean, components } = result.positions;
            return mean[p].map((m, c) => Object.entries(at).reduce((sum, [k, sd]) =>
                sum + sd * Math.sqrt(result.eigenvalues[+k - 1]) * (components?.[+k - 1]?.[p][c] ?? 0), m));
        }
        const middle = right + radii[p] * sizes[p];
        right = middle + 1.15 * radii[p] * sizes[p];
        return [middle, 0, 0];
    });
}

export interface Mode { component: number; part: string; deviations: number; relativeEnergy: number | null }

/** Components of which there are surfaces, and for each the places along it, the mean among them. */
export function placesOf(modes: Mode[]): Map<number, number[]> {
    const places = new Map<number, number[]>();
    for (const { component, deviations } of modes) {
        const list = places.get(component) ?? [0];
        if (!list.includes(deviations)) list.push(deviations);
        places.set(component, list.sort((a, b) => a - b));
    }
    return places;
}

/** Of a part: its mean, and for each component its shapes at all places along it, the mean among them. */
export interface Frames { mean: Surface3; along: Map<number, Surface3[]> }

/** Positions of a part at these standard deviations: displacements along single components are added. */
export function movePart(to: Surface3, frames: Frames, places: Map<number, number[]>, at: Record<number, number>, size: number, middle: number[]): void {
    const base = frames.mean.positions;
    const { positions } = to;
    positions.set(base);
    for (const [component, sd] of Object.entries(at)) {
        const along = frames.along.get(+component);
        if (!along || !sd) continue;
        for (const [k, w] of between(places.get(+component)!, sd)) {
            const from = along[k].positions;
            for (let i = 0; i < positions.length; i++) positions[i] += w * (from[i] - base[i]);
        }
    }
    for (let i = 0; i < positions.length; i++) positions[i] = size * positions[i] + middle[i % 3];
}
