// Maps on shapes: their colours, and the bar that says what these mean.
import { colourAt, colourText, coloursOf, grey } from './colours';
import type { Scale } from './colours';
import type { Field } from './glb';
import { t } from './i18n';
import { figure } from './text';

export interface Map3 { field: Field; scale: Scale; low: number; high: number; keep?: (value: number, vertex: number) => boolean; title?: string }

/** What points inwards or outwards, even where all of it goes one way. */
const SIGNED = /^(normalEffect|deviation|zScore|slope|between)$/;

/** A field as it is usually shown: what has a sign about zero, all else from its least to its greatest. */
export function mapOf(field: Field): Map3 {
    if (SIGNED.test(field.name) || (field.low < 0 && field.high > 0)) {
        const most = Math.max(Math.abs(field.low), Math.abs(field.high)) || 1;
        return { field, scale: 'signed', low: -most, high: most };
    }
    if (/significance|fdr|pvalue/i.test(field.name)) return { field, scale: 'cividis', low: 0, high: 1 };
    return { field, scale: 'cividis', low: field.low, high: field.high > field.low ? field.high : field.low + 1 };
}

export function paintedBy(map: Map3): Float32Array {
    const part = (v: number) => (v - map.low) / (map.high - map.low);
    const flip = isFlipped(map);
    const at = (v: number) => colourAt(map.scale, flip ? 1 - part(v) : part(v));
    if (!map.keep) return coloursOf(map.field.values, at);
    const { keep } = map;
    const colours = coloursOf(map.field.values, at);
    const dull = coloursOf(new Float32Array(1), () => grey);
    for (let i = 0; i < map.field.values.length; i++) if (!keep(map.field.values[i], i)) colours.set(dull, 3 * i);
    return colours;
}

export const isFlipped = (map: Map3): boolean => /significance|fdr|pvalue/i.test(map.field.name);

/** The colour of a share of the range of a map. */
export const colourOf = (map: Map3, share: number): string => colourText(map.scale, isFlipped(map) ? 1 - share : share);

/** Of a map as people write it. A length is that of the shapes that were compared: in the units of the files, or of shapes of unit area. */
export const unitOf = (field: Field): string => (field.unit === 'length' ? t`units of the shape` : field.unit && field.unit !== '1' ? field.unit : '');
const NAMES: Record<string, string> = { significance: t`p, corrected for all points`, fdr: t`false discovery rate`, zScore: 'z score', lmax: 'degree', between: t`distance of the other surface, outwards` };
export const nameOfMap = (name: string): string => NAMES[name] ?? name.replace(/([a-z0-9])([A-Z])/g, '$1 $2').toLowerCase();

export const titleOf = (map: Map3): string => map.title ?? `${nameOfMap(map.field.name)}${unitOf(map.field) ? ` (${unitOf(map.field)})` : ''}`;

export function ColourBar({ map, threshold }: { map: Map3; threshold?: number }) {
    const flip = isFlipped(map);
    const stops = Array.from({ length: 11 }, (_, i) => i / 10);
    const tick = threshold === undefined ? null : (threshold - map.low) / (map.high - map.low);
    const title = titleOf(map);
    const id = `bar-${map.field.name}-${map.scale}${flip ? '-f' : ''}`;
    return (
        <svg class="bar" viewBox="0 0 240 46" role="img" aria-label={t`Colours of ${title}: from ${figure(map.low)} to ${figure(map.high)}`}>
            <defs><linearGradient id={id}>{stops.map((s) => <stop offset={s} stop-color={colourOf(map, s)} />)}</linearGradient></defs>
            <text x="8" y="12" font-size="11" fill="currentColor">{title}</text>
            <rect x="8" y="17" width="224" height="11" fill={`url(#${id})`} />
            {tick !== null && tick >= 0 && tick <= 1 && <path d={`M${8 + 224 * tick} 14V31`} stroke="currentColor" stroke-width="2" />}
            <text x="8" y="42" font-size="11" fill="currentColor">{figure(map.low)}</text>
            <text x="232" y="42" font-size="11" fill="currentColor" text-anchor="end">{figure(map.high)}</text>
        </svg>
    );
}
