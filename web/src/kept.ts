// What a view shows, kept in the query of its address, so that a link to it shows the same: sliders, chosen marks, maps
// with their ranges, cameras. What an address says and a view cannot show is passed over.
import { useCallback, useEffect, useRef, useState } from 'preact/hooks';
import { came, queryOf, remember } from './router';

/** How a value is written in an address; what it cannot be read from is undefined. */
export interface Written<T> { write: (value: T) => string; read: (text: string) => T | undefined }

// ---- Addresses -------------------------------------------------------------------------------------------------------

const WAIT_MS = 400; // browsers refuse more than a hundred changes of an address in half a minute
const waiting = new Map<string, string | null>();
let page = '';
let timer = 0;

const pageOf = (): string => location.hash.split('?')[0];

function flush(): void {
    clearTimeout(timer);
    timer = 0;
    if (page === pageOf() && waiting.size) remember(Object.fromEntries(waiting));
    waiting.clear();
}
addEventListener('pagehide', flush);

/** Soon in the address, without a step in the history; null leaves it. */
export function keep(name: string, text: string | null): void {
    if (page !== pageOf()) waiting.clear();
    page = pageOf();
    waiting.set(name, text);
    timer ||= window.setTimeout(flush, WAIT_MS);
}

/** What the address says, or is about to. */
export const keptText = (name: string): string | null =>
    (page === pageOf() && waiting.has(name) ? waiting.get(name)! : queryOf().get(name));

function found<T>(name: string | undefined, how: Written<T>): T | undefined {
    const text = name === undefined ? null : keptText(name);
    return text === null ? undefined : how.read(text);
}

type Setter<T> = (next: T | ((was: T) => T)) => void;

/** A state of a view that its address has under a name; without one it is a plain state. Its setter stays the same. */
export function useKept<T>(name: string | undefined, first: T, how: Written<T>): [T, Setter<T>] {
    const [value, show] = useState<T>(() => found(name, how) ?? first);
    const now = useRef(value);
    const by = useRef({ name, first, how });
    by.current = { name, first, how };
    const set = useCallback<Setter<T>>((next) => {
        const { name: key, first: usual, how: way } = by.current;
        now.current = typeof next === 'function' ? (next as (was: T) => T)(now.current) : next;
        show(() => now.current);
        if (key === undefined) return;
        const text = now.current === undefined ? null : way.write(now.current);
        keep(key, text === (usual === undefined ? null : way.write(usual)) ? null : text);
    }, []);
    // Somebody followed a link to the same page, or went back to another state of it.
    useEffect(() => came.listen(() => {
        now.current = found(by.current.name, by.current.how) ?? by.current.first;
        show(() => now.current);
    }), []);
    return [value, set];
}

// ---- Values ----------------------------------------------------------------------------------------------------------

/** Short, and as near as a slider can tell. */
const short = (v: number): string => `${+v.toPrecision(5)}`;
const finite = (text: string): number | undefined => (text.trim() !== '' && Number.isFinite(+text) ? +text : undefined);

export const aText: Written<string> = { write: (v) => v, read: (text) => text };
export const aSwitch: Written<boolean> = { write: (v) => (v ? 'yes' : 'no'), read: (text) => (text === 'yes' ? true : text === 'no' ? false : undefined) };

export const aNumber = (low: number, high: number): Written<number> => ({
    write: short,
    read: (text) => {
        const v = finite(text);
        return v === undefined ? undefined : Math.max(low, Math.min(high, v));
    },
});

/** A place in a list of so many. */
export const aPlace = (many: number, from = 0): Written<number> => ({
    write: (v) => `${v}`,
    read: (text) => (/^\d+$/.test(text) && +text >= from && +text < many + from ? +text : undefined),
});

export const oneOf = (texts: readonly string[]): Written<string> => ({ write: (v) => v, read: (text) => (texts.includes(text) ? text : undefined) });

/** What may be undefined, which is not written. */
export const maybe = <T>(how: Written<T>): Written<T | undefined> => how as Written<T | undefined>;

/** Values at numbered sliders, those at 0 left out: 1:2,3:-1.5 */
export const sliders = (many: number, most: number): Written<Record<number, number>> => ({
    write: (v) => Object.entries(v).filter(([, x]) => x !== 0).map(([k, x]) => `${k}:${short(x)}`).join(','),
    read: (text) => {
        const pairs = text.split(',').map((pair) => pair.split(':').map(finite))
            .filter(([k, x]) => Number.isInteger(k) && k! >= 1 && k! <= many && x !== undefined);
        return pairs.length ? Object.fromEntries(pairs.map(([k, x]) => [k, Math.max(-most, Math.min(most, x!))])) : undefined;
    },
});
