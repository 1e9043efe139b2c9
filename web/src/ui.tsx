// What pages are made of: problems as the service tells them, states of loading, tables of any length, parts loaded
// when they are first shown.
import type { ComponentChildren, ComponentType } from 'preact';
import { useCallback, useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { Failure, offline } from './api';
import type { Problem } from './api';
import { t } from './i18n';

export { FORMATS, csv, errorOf, figure, plural, save, size, span, spread, when } from './text';

export function problemOf(error: unknown): Problem {
    if (error instanceof Failure) return error.problem;
    return { ...offline().problem, code: 'page', title: t`The page failed`, detail: `${error}` };
}

const WAYS: Record<string, string> = {
    'token-required': t`Enter a token under Settings.`,
    'token-invalid': t`Enter another token under Settings.`,
    'no-answer': t`The page goes on by itself when it answers again.`,
    table: t`A table has a column file with the names of the meshes, which were sent before it or with it. A spreadsheet saves one as CSV.`,
    'in-use': t`Delete what needs it first, or delete it together with that.`,
};

export function ProblemBox({ error, again }: { error: unknown; again?: () => void }) {
    const problem = problemOf(error);
    return (
        <div class="problem" role="alert">
            <strong>{problem.title}</strong>
            <p>{problem.detail}</p>
            {problem.errors && (
                <ul>{problem.errors.map((e) => <li><code>{e.pointer}</code> {e.detail}</li>)}</ul>
            )}
            {WAYS[problem.code] && <p>{WAYS[problem.code]}</p>}
            <p class="quiet">
                {problem.code}{problem.requestId ? `, ${problem.requestId}` : ''}{' '}
                {again && <button onClick={again}>{t`Try again`}</button>}
            </p>
        </div>
    );
}

export interface Loaded<T> { value?: T; error?: unknown; reload: () => void }

/** What a function fetches; fetched anew where one of the keys changes. */
export function useLoad<T>(load: (signal: AbortSignal) => Promise<T>, keys: unknown[]): Loaded<T> {
    const [state, setState] = useState<{ value?: T; error?: unknown }>({});
    const [round, setRound] = useState(0);
    useEffect(() => {
        const stop = new AbortController();
        load(stop.signal).then(
            (value) => !stop.signal.aborted && setState({ value }),
            (error) => !stop.signal.aborted && setState((s) => ({ value: s.value, error })),
        );
        return () => stop.abort();
    }, [...keys, round]);
    const reload = useCallback(() => setRound((n) => n + 1), []);
    return { ...state, reload };
}

/** What was loaded, or how far that is. With page, all of a page, which has a heading meanwhile too. */
export function Shown<T>({ of, children, label, page }: {
    of: Loaded<T>; label?: string; page?: boolean; children: (value: T) => ComponentChildren;
}) {
    if (of.value === undefined && of.error) {
        const box = <ProblemBox error={of.error} again={of.reload} />;
        return page ? <Page title={problemOf(of.error).title || t`A problem`}>{box}</Page> : box;
    }
    if (of.value === undefined) {
        const text = `Loading${label ? ` ${label}` : ''}…`;
        return page ? <header class="page-head"><h1 tabIndex={-1} aria-busy="true">{text}</h1></header> : <p class="quiet" aria-busy="true">{text}</p>;
    }
    return <>{of.error ? <ProblemBox error={of.error} again={of.reload} /> : null}{children(of.value)}</>;
}

/** A part of the dashboard that comes in a chunk of its own. */
export function later<P extends object>(load: () => Promise<ComponentType<P>>): ComponentType<P> {
    let part: ComponentType<P> | undefined;
    return function Later(props: P) {
        const [, again] = useState(0);
        const [error, setError] = useState<unknown>();
        useEffect(() => {
            // It may have come between what was drawn and this: then it is only to be drawn again.
            if (part) again((n) => n + 1);
            else load().then((p) => { part = p; again((n) => n + 1); }, setError);
        }, []);
        const Part = part as any;
        if (error) return <ProblemBox error={error} again={() => location.reload()} />;
        return Part ? <Part {...props} /> : <p class="quiet" aria-busy="true">{t`Loading…`}</p>;
    };
}

/** A page was gone to whose heading is not there yet. */
let awaited = false;

/** The focus goes to the heading of a page that was gone to, as soon as there is one. */
export function arrive(): void {
    const heading = document.querySelector<HTMLElement>('main h1');
    heading?.focus({ preventScroll: true });
    awaited = !heading || heading.ariaBusy === 'true';
}

export function Page({ title, actions, children }: {
    title: string; actions?: ComponentChildren; children: ComponentChildren;
}) {
    const heading = useRef<HTMLHeadingElement>(null);
    useEffect(() => {
        if (awaited && [null, document.body].includes(document.activeElement as HTMLElement | null)) heading.current?.focus({ preventScroll: true });
        awaited = false;
    }, []);
    useEffect(() => {
        document.title = `${title} – srnfd`;
    }, [title]);
    return (
        <>
            <header class="page-head">
                <h1 tabIndex={-1} ref={heading}>{title}</h1>
                <div class="actions">{actions}</div>
            </header>
            {children}
        </>
    );
}

export const Meter = ({ value, label }: { value: number; label: string }) => (
    <progress max={100} value={Math.max(0, Math.min(100, value))} aria-label={label} />
);

// ---- Long tables -----------------------------------------------------------------------------------------------------

const ROW = 34;
const BEYOND = 4; // rows that are kept ready above and below those in sight

/** By: what the list is sorted by when the title is pressed, once up and once down. */
export interface Column<T> { title: string; width?: string; hidden?: boolean; by?: (item: T) => string | number | null | undefined }

const rank = (a: unknown, b: unknown): number => (typeof a === 'number' && typeof b === 'number' ? a - b : `${a}`.localeCompare(`${b}`, undefined, { numeric: true }));

function sorted<T>(items: T[], column: Column<T> | undefined, down: boolean): T[] {
    const by = column?.by;
    if (!by) return items;
    const known = items.map((item) => ({ item, value: by(item) }));
    const lacks = (v: unknown) => v === null || v === undefined || v === '';
    return known.sort((a, b) => +lacks(a.value) - +lacks(b.value) || (down ? -1 : 1) * (lacks(a.value) ? 0 : rank(a.value, b.value))).map((k) => k.item);
}

/** Only the rows in sight are in the page, so ten thousand scroll as ten do. */
export function LongTable<T>({ items: given, columns, label, row, keyOf }: {
    items: T[]; columns: Column<T>[]; label: string;
    /** Of an item, its place among those that are shown, and these in their order. */
    row: (item: T, index: number, all: T[]) => ComponentChildren[]; keyOf: (item: T) => string;
}) {
    const box = useRef<HTMLDivElement>(null);
    const [top, setTop] = useState(0);
    const [height, setHeight] = useState(600);
    const [order, setOrder] = useState<{ title: string; down: boolean } | null>(null);
    const items = useMemo(() => sorted(given, columns.find((c) => c.title === order?.title), !!order?.down), [given, order]);
    const press = (title: string) => setOrder(order?.title !== title ? { title, down: false } : order.down ? null : { title, down: true });
    useEffect(() => {
        const watch = new ResizeObserver(() => box.current && setHeight(box.current.clientHeight));
        watch.observe(box.current!);
        return () => watch.disconnect();
    }, []);
    // What has no width of its own keeps ten letters or so: more columns than fit are scrolled to.
    const least = columns.reduce((sum, c) => sum + (c.width ? parseFloat(c.width) : 9), 0);
    const inSight = Math.ceil(height / ROW) + 2 * BEYOND;
    const first = Math.max(0, Math.min(Math.floor(top / ROW) - BEYOND, items.length - inSight)); // a list may have become shorter
    const last = Math.min(items.length, first + inSight);
    return (
        <div class="long" ref={box} tabIndex={0} role="region" aria-label={label}
            onScroll={(e) => setTop(e.currentTarget.scrollTop)}>
            <table aria-rowcount={items.length + 1} style={{ minWidth: `${least}rem` }}>
                <thead>
                    <tr>{columns.map((c) => {
                        const sort = order?.title === c.title ? (order.down ? 'descending' : 'ascending') : undefined;
                        return (
                            <th scope="col" style={c.width ? { width: c.width } : undefined} aria-sort={sort}>{c.hidden ? <span class="sr">{c.title}</span>
                                : c.by ? <button class="plain-button sort" title={t`Sort by ${c.title.toLowerCase()}`} onClick={() => press(c.title)}>{c.title}<span aria-hidden="true">{sort ? (order!.down ? ' ▾' : ' ▴') : ''}</span></button> : c.title}</th>
                        );
                    })}</tr>
                </thead>
                <tbody>
                    {first > 0 && <tr aria-hidden="true"><td class="gap" colSpan={columns.length} style={{ height: `${first * ROW}px` }} /></tr>}
                    {items.slice(first, last).map((item, i) => (
                        <tr key={keyOf(item)} aria-rowindex={first + i + 2}>
                            {row(item, first + i, items).map((cell) => <td>{cell}</td>)}
                        </tr>
                    ))}
                    {last < items.length && (
                        <tr aria-hidden="true"><td class="gap" colSpan={columns.length} style={{ height: `${(items.length - last) * ROW}px` }} /></tr>
                    )}
                </tbody>
            </table>
        </div>
    );
}

/** Asks before what cannot be undone. */
export function Sure({ children, title, onYes, question }: {
    children: ComponentChildren; title?: string; question: string; onYes: () => void;
}) {
    const dialog = useRef<HTMLDialogElement>(null);
    return (
        <>
            <button class="risky" title={title} onClick={() => dialog.current!.showModal()}>{children}</button>
            <dialog ref={dialog} aria-label={question}>
                <p>{question}</p>
                <div class="actions">
                    <button class="risky" onClick={() => { dialog.current!.close(); onYes(); }}>{children}</button>
                    <button autofocus onClick={() => dialog.current!.close()}>{t`Keep`}</button>
                </div>
            </dialog>
        </>
    );
}
