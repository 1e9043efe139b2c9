// Landmarks of a form: placed by clicks on both shapes, one after the other.
import { useMemo, useState } from 'preact/hooks';
import { Marked, useGround } from './landmarks';
import type { Ground, Place } from './landmarks';
import { shown } from './shape';
import { Camera, pick } from './stage';
import { ProblemBox, figure } from './ui';

type Given = Record<string, any>;

function parsed(text: string): Given {
    try {
        const value = JSON.parse(text);
        return value && typeof value === 'object' ? value : {};
    } catch {
        return {};
    }
}

const said = (place: Place | undefined): string => (place === undefined ? 'not placed yet' : Array.isArray(place) ? place.map((v) => figure(v)).join(', ') : `vertex ${place}`);

/** One of both shapes; a click places the next landmark that it lacks. */
function End({ title, id, places, add }: { title: string; id: string; places: Place[]; add: (place: Place) => void }) {
    const { ground, error } = useGround(id);
    const camera = useMemo(() => new Camera(), []);
    const put = (of: Ground, vertex: number) => add(of.vertices ? vertex : [...of.shape.positions.slice(3 * vertex, 3 * vertex + 3)]);
    const centre = (of: Ground, event: Event) => {
        const canvas = (event.currentTarget as HTMLElement).closest('figure')!.querySelector('canvas')!;
        const vertex = pick(of.shape, camera, shown.get(canvas)!.look, canvas.clientWidth / canvas.clientHeight, 0.5, 0.5);
        if (vertex !== undefined) put(of, vertex);
    };
    if (error) return <ProblemBox error={error} />;
    return (
        <figure class="shape small-view">
            <figcaption>{title}: <span class="quiet">click for landmark {places.length + 1}</span></figcaption>
            {ground ? <Marked ground={ground} places={places} label={title} camera={camera} onPick={(vertex) => put(ground, vertex)} /> : <div class="view" aria-busy="true" />}
            {ground && <button type="button" onClick={(e) => centre(ground, e)}>{`Landmark at the middle of ${title}`}</button>}
        </figure>
    );
}

export function LandmarkField({ ends, ids, text, set }: { ends: [string, string]; ids: [string, string]; text: string; set: (text: string) => void }) {
    const given = useMemo(() => parsed(text), [text]);
    const [open, setOpen] = useState(text !== '');
    const lists = ends.map((end): Place[] => (Array.isArray(given[end]) ? given[end] : []));
    const held: number[] = Array.isArray(given.heldOut) ? given.heldOut : [];
    const n = Math.max(...lists.map((l) => l.length));
    const change = (next: Given) => {
        const [a, b] = ends.map((end) => next[end] ?? []);
        set(a.length || b.length ? JSON.stringify({ ...next, [ends[0]]: a, [ends[1]]: b, heldOut: next.heldOut?.length ? next.heldOut : undefined }) : '');
    };
    const remove = (i: number) => change({
        ...given, ...Object.fromEntries(ends.map((end, e) => [end, lists[e].filter((_, k) => k !== i)])),
        heldOut: held.filter((h) => h !== i).map((h) => (h > i ? h - 1 : h)),
    });
    const hold = (i: number) => change({ ...given, heldOut: held.includes(i) ? held.filter((h) => h !== i) : [...held, i].sort((a, b) => a - b) });
    const ready = ids.every(Boolean);
    if (!open || !ready) return <button type="button" disabled={!ready} onClick={() => setOpen(true)}>{ready ? 'Place landmarks on both shapes' : `Choose ${ends.join(' and ')} first`}</button>;
    return (
        <div>
            <div class="split">{ends.map((end, e) => <End key={`${end} ${ids[e]}`} title={end} id={ids[e]} places={lists[e]} add={(place) => change({ ...given, [end]: [...lists[e], place] })} />)}</div>
            {n > 0 && (
                <ol class="plain" aria-label="Landmarks">{Array.from({ length: n }, (_, i) => (
                    <li class="row" key={i}>
                        <strong>{i + 1}</strong> <span class="quiet grow">{ends.map((end, e) => `${end}: ${said(lists[e][i])}`).join('; ')}</span>
                        <label class="check"><input type="checkbox" checked={held.includes(i)} onChange={() => hold(i)} /> held out</label>
                        <button type="button" aria-label={`Remove landmark ${i + 1}`} onClick={() => remove(i)}>Remove</button>
                    </li>
                ))}</ol>
            )}
            {n > 0 && (
                <div class="row">
                    <label>Met <select value={typeof given.weight === 'number' ? 'weight' : 'exact'} onChange={(e) => change({ ...given, weight: e.currentTarget.value === 'exact' ? undefined : 1 })}>
                        <option value="exact">exactly</option><option value="weight">as far as a weight asks</option>
                    </select></label>
                    {typeof given.weight === 'number' && <label>Weight <input type="number" min={0} step="any" value={given.weight} onInput={(e) => change({ ...given, weight: +e.currentTarget.value })} /></label>}
                </div>
            )}
        </div>
    );
}
