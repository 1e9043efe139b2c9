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
