// Figures as pages and reports write them, and files that are taken away.
import { decimal, t } from './i18n';

export { plural, when, whole } from './i18n';

export function figure(x: number | null | undefined, digits = 3): string {
    if (x === null || x === undefined || !Number.isFinite(x)) return '–';
    if (x !== 0 && (Math.abs(x) < 1e-3 || Math.abs(x) >= 1e6)) return decimal(x.toExponential(digits - 1));
    return decimal(`${+x.toPrecision(digits)}`);
}

/** Where the p of all permutations lies, at 95 %, in brackets; nothing where all were taken. */
export function errorOf(interval?: (number | null)[]): string {
    const [low, high] = interval ?? [];
    return typeof low === 'number' && typeof high === 'number' && low !== high ? t` (${figure(low)} to ${figure(high)})` : '';
}

/** An estimate with its interval, as far as there is one. */
export function spread(value: number | null | undefined, interval?: (number | null)[] | null): string {
    const known = interval?.filter((v) => typeof v === 'number') ?? [];
    return known.length === 2 ? t`${figure(value)} (95 %: ${figure(known[0])} to ${figure(known[1])})` : figure(value);
}

export function size(n: number): string {
    return n < 1000 ? `${n} B` : n < 1e6 ? t`${Math.round(n / 1000)} kB` : n < 1e9 ? t`${decimal((n / 1e6).toFixed(1))} MB` : t`${decimal((n / 1e9).toFixed(1))} GB`;
}

export function span(seconds: number): string {
    const s = Math.max(0, Math.round(seconds));
    return s < 60 ? `${s} s` : s < 3600 ? t`${Math.floor(s / 60)} min ${s % 60} s` : t`${Math.floor(s / 3600)} h ${Math.floor((s % 3600) / 60)} min`;
}

/** Files of shapes that the service writes. */
export const FORMATS = ['ply', 'obj', 'stl', 'vtk', 'vtp', 'gii', 'glb'];

// ---- Files out -------------------------------------------------------------------------------------------------------

export function save(name: string, body: Blob | string, type = 'text/plain;charset=utf-8'): void {
    const url = URL.createObjectURL(body instanceof Blob ? body : new Blob([body], { type }));
    const anchor = document.createElement('a');
    anchor.href = url;
    anchor.download = name;
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
}

/** A cell that begins as a formula does is text to a spreadsheet too. */
export function csv(rows: (string | number | null | undefined)[][]): string {
    const cell = (c: string | number | null | undefined) => {
        if (c === null || c === undefined) return '';
        if (typeof c === 'number') return `${c}`;
        const text = /^[=+\-@\t\r]/.test(c) ? `'${c}` : c;
        return /[",\n\r]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
    };
    return rows.map((row) => row.map(cell).join(',')).join('\r\n') + '\r\n';
}
