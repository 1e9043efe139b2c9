// Colours that the colour-blind tell apart: cividis for magnitudes, blue over white to orange for what has a sign, the
// palette of Okabe and Ito for groups, which differ by the shape of the mark too.

const CIVIDIS = ['#00224e', '#123570', '#3b496c', '#575d6d', '#707173', '#8a8678', '#a59c74', '#c3b369', '#e1cc55', '#fee838'];
const SIGNED = ['#0b4f8a', '#3f85bd', '#8fbbdd', '#d3e3ef', '#f5f5f5', '#f6dcc4', '#eeae76', '#d8752a', '#a04000'];
export const GROUPS = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9', '#7a7a00', '#5b5b5b'];
export const MARKS = ['circle', 'square', 'triangle', 'diamond', 'cross', 'star'] as const;
export const GREY = '#9a9a9a';

type Rgb = [number, number, number];
const rgb = (hex: string): Rgb => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255) as Rgb;

export type Scale = 'cividis' | 'signed';

const stops: Record<Scale, Rgb[]> = { cividis: CIVIDIS.map(rgb), signed: SIGNED.map(rgb) };

/** Of t from 0 to 1, in sRGB. */
export function colourAt(scale: Scale, t: number): Rgb {
    const list = stops[scale];
    const x = Math.max(0, Math.min(1, t)) * (list.length - 1);
    const i = Math.min(list.length - 2, Math.floor(x));
    return list[i].map((c, k) => c + (x - i) * (list[i + 1][k] - c)) as Rgb;
}

export const css = ([r, g, b]: Rgb): string => `rgb(${[r, g, b].map((c) => Math.round(255 * c)).join(' ')})`;
export const colourText = (scale: Scale, t: number): string => css(colourAt(scale, t));
export const grey = rgb(GREY);

/** Vertex colours, linear as three wants them; grey where the test says so. */
export function coloursOf(values: Float32Array, at: (value: number) => [number, number, number]): Float32Array {
    const colours = new Float32Array(3 * values.length);
    const table = new Map<number, [number, number, number]>();
    const linear = (c: number) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    for (let i = 0; i < values.length; i++) {
        let colour = table.get(values[i]);
        if (!colour) {
            colour = at(values[i]).map(linear) as [number, number, number];
            if (table.size < 4096) table.set(values[i], colour);
        }
        colours.set(colour, 3 * i);
    }
    return colours;
}

export const PATHS: Record<(typeof MARKS)[number], string> = {
    circle: 'M5 0A5 5 0 1 1 -5 0A5 5 0 1 1 5 0Z', square: 'M-4.5-4.5H4.5V4.5H-4.5Z', triangle: 'M0-6L5.5 4.5H-5.5Z',
    diamond: 'M0-6L5 0L0 6L-5 0Z', cross: 'M-2-6H2V-2H6V2H2V6H-2V2H-6V-2H-2Z', star: 'M0-6L1.8-1.8L6-1.8L2.6 1.2L4 6L0 3.2L-4 6L-2.6 1.2L-6-1.8L-1.8-1.8Z',
};

/** The mark and the colour of a group. */
export function groupLook(groups: string[], group?: string | null): { colour: string; path: string } {
    const i = group ? groups.indexOf(group) : -1;
    return i < 0 ? { colour: GROUPS[7], path: PATHS.circle } : { colour: GROUPS[i % 7], path: PATHS[MARKS[i % MARKS.length]] };
}
