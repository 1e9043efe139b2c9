// Figures as pages and reports write them, and files that are taken away.
export const plural = (n: number, one: string, many = `${one}s`): string => `${n.toLocaleString('en')} ${n === 1 ? one : many}`;

export function figure(x: number | null | undefined, digits = 3): string {
    if (x === null || x === undefined || !Number.isFinite(x)) return '–';
    if (x !== 0 && (Math.abs(x) < 1e-3 || Math.abs(x) >= 1e6)) return x.toExponential(digits - 1);
    return `${+x.toPrecision(digits)}`;
}

export function size(n: number): string {
    return n < 1000 ? `${n} B` : n < 1e6 ? `${Math.round(n / 1000)} kB` : n < 1e9 ? `${(n / 1e6).toFixed(1)} MB` : `${(n / 1e9).toFixed(1)} GB`;
}

export function span(seconds: number): string {
    const s = Math.max(0, Math.round(seconds));
    return s < 60 ? `${s} s` : s < 3600 ? `${Math.floor(s / 60)} min ${s % 60} s` : `${Math.floor(s / 3600)} h ${Math.floor((s % 3600) / 60)} min`;
}

export const when = (text?: string): string => (text ? new Date(text).toLocaleString(undefined, { dateStyle: 'medium', timeStyle: 'short' }) : '–');

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
