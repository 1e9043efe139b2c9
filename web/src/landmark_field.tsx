// Landmarks of a form: placed by clicks on both shapes, one after the other, or on each member of a group.
import { useMemo, useState } from 'preact/hooks';
import { t } from './i18n';
import { Marked, useGround } from './landmarks';
import type { Ground, Place } from './landmarks';
import { shown } from './shape';
import { Camera, pick } from './stage';
import { namesOf } from './names';
import { ProblemBox, figure, plural, useLoad } from './ui';

type Given = Record<string, any>;

function parsed(text: string): Given {
    try {
        const value = JSON.parse(text);
        return value && typeof value === 'object' ? value : {};
    } catch {
        return {};
    }
}

const said = (place: Place | undefined): string => (place === undefined ? t`not placed yet` : Array.isArray(place) ? place.map((v) => figure(v)).join(', ') : t`vertex ${place}`);

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
            <figcaption>{title}: <span class="quiet">{t`click for landmark ${places.length + 1}`}</span></figcaption>
            {ground ? <Marked ground={ground} places={places} label={title} camera={camera} onPick={(vertex) => put(ground, vertex)} /> : <div class="view" aria-busy="true" />}
            {ground && <button type="button" onClick={(e) => centre(ground, e)}>{t`Landmark at the middle of ${title}`}</button>}
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
    if (!open || !ready) return <button type="button" disabled={!ready} onClick={() => setOpen(true)}>{ready ? t`Place landmarks on both shapes` : t`Choose ${ends.join(' and ')} first`}</button>;
    return (
        <div>
            <div class="split">{ends.map((end, e) => <End key={`${end} ${ids[e]}`} title={end} id={ids[e]} places={lists[e]} add={(place) => change({ ...given, [end]: [...lists[e], place] })} />)}</div>
            {n > 0 && (
                <ol class="plain" aria-label={t`Landmarks`}>{Array.from({ length: n }, (_, i) => (
                    <li class="row" key={i}>
                        <strong>{i + 1}</strong> <span class="quiet grow">{ends.map((end, e) => `${end}: ${said(lists[e][i])}`).join('; ')}</span>
                        <label class="check"><input type="checkbox" checked={held.includes(i)} onChange={() => hold(i)} /> {t`held out`}</label>
                        <button type="button" aria-label={t`Remove landmark ${i + 1}`} onClick={() => remove(i)}>{t`Remove`}</button>
                    </li>
                ))}</ol>
            )}
            {n > 0 && <Met weight={given.weight} set={(weight) => change({ ...given, weight })} />}
        </div>
    );
}

function Met({ weight, set }: { weight: unknown; set: (weight: number | undefined) => void }) {
    return (
        <div class="row">
            <label>{t`Met`} <select value={typeof weight === 'number' ? 'weight' : 'exact'} onChange={(e) => set(e.currentTarget.value === 'exact' ? undefined : 1)}>
                <option value="exact">{t`exactly`}</option><option value="weight">{t`as far as a weight asks`}</option>
            </select></label>
            {typeof weight === 'number' && <label>{t`Weight`} <input type="number" min={0} step="any" value={weight} onInput={(e) => set(+e.currentTarget.value)} /></label>}
        </div>
    );
}

/** Points on each member of a group, or vertices that are the same in all; one member is seen at a time. */
export function GroupLandmarkField({ ids, text, set }: { ids: string[]; text: string; set: (text: string) => void }) {
    const given = useMemo(() => parsed(text), [text]);
    const [open, setOpen] = useState(text !== '');
    const [member, setMember] = useState(0);
    const names = useLoad(() => namesOf(ids), [ids.join()]).value;
    const same = Array.isArray(given.vertices);
    const lists: Place[][] = ids.map((_, i) => (same ? given.vertices : Array.isArray(given.points?.[i]) ? given.points[i] : []));
    const held: number[] = Array.isArray(given.heldOut) ? given.heldOut : [];
    const n = Math.max(0, ...lists.map((l) => l.length));
    const put = (next: { lists?: Place[][]; vertices?: boolean; heldOut?: number[]; weight?: number }) => {
        const all = next.lists ?? lists;
        const [heldOut, weight] = [next.heldOut ?? held, 'weight' in next ? next.weight : given.weight];
        const rest = { weight, heldOut: heldOut.length ? heldOut : undefined };
        if (!all.some((l) => l.length)) set(next.vertices ?? same ? JSON.stringify({ vertices: [] }) : '');
        else set(JSON.stringify(next.vertices ?? same ? { vertices: all[0], ...rest } : { points: all, ...rest }));
    };
    const name = (i: number): string => names?.get(ids[i]) ?? t`member ${i + 1}`;
    const add = (place: Place) => {
        const next = lists.map((l, i) => (same || i === member ? [...l, place] : l));
        put({ lists: next });
        // On to the next member that lacks what this one has.
        if (!same && next[member].length >= n) setMember(Math.max(0, next.findIndex((l) => l.length < next[member].length)));
    };
    const remove = (k: number) => put({ lists: lists.map((l) => l.filter((_, i) => i !== k)), heldOut: held.filter((h) => h !== k).map((h) => (h > k ? h - 1 : h)) });
    const takeBack = () => put({ lists: lists.map((l, i) => (i === member ? l.slice(0, -1) : l)) });
    if (!open || !ids.length) return <button type="button" disabled={!ids.length} onClick={() => setOpen(true)}>{ids.length ? t`Place landmarks on the members` : t`Choose a cohort first`}</button>;
    const lacking = lists.filter((l) => l.length < n).length;
    const meshes = ids.every((id) => id.startsWith('mesh-'));
    return (
        <div>
            <div class="row">
                {!same && <label>{t`Member`} <select value={member} onChange={(e) => setMember(+e.currentTarget.value)}>
                    {ids.map((_, i) => <option value={i}>{t`${name(i)}: ${lists[i].length} of ${n}`}</option>)}
                </select></label>}
                {!same && <button type="button" disabled={member === 0} onClick={() => setMember(member - 1)}>{t`Previous`}</button>}
                {!same && <button type="button" disabled={member + 1 === ids.length} onClick={() => setMember(member + 1)}>{t`Next`}</button>}
                {!same && lists[member].length > 0 && <button type="button" onClick={takeBack}>{t`Take back the last`}</button>}
                {meshes && <label class="check"><input type="checkbox" checked={same} onChange={(e) => put({ lists: ids.map(() => []), vertices: e.currentTarget.checked, heldOut: [] })} /> {t`The meshes have vertices that correspond`}</label>}
            </div>
            <End key={ids[same ? 0 : member]} title={name(same ? 0 : member)} id={ids[same ? 0 : member]} places={lists[same ? 0 : member]} add={add} />
            {n > 0 && (
                <ol class="plain" aria-label={t`Landmarks`}>{Array.from({ length: n }, (_, k) => {
                    const on = lists.filter((l) => l.length > k).length;
                    return (
                        <li class="row" key={k}>
                            <strong>{k + 1}</strong> <span class="quiet grow">{same ? t`${said(lists[0][k])} of all members` : t`placed on ${on} of ${plural(ids.length, 'member')}`}</span>
                            <label class="check"><input type="checkbox" checked={held.includes(k)} onChange={() => put({ heldOut: held.includes(k) ? held.filter((h) => h !== k) : [...held, k].sort((a, b) => a - b) })} /> {t`held out`}</label>
                            <button type="button" aria-label={t`Remove landmark ${k + 1}`} onClick={() => remove(k)}>{t`Remove`}</button>
                        </li>
                    );
                })}</ol>
            )}
            {n > 0 && lacking > 0 && <p class="wrong" role="status">{t`${plural(lacking, 'member lacks', 'members lack')} a landmark that others have.`}</p>}
            {n > 0 && <Met weight={given.weight} set={(weight) => put({ weight })} />}
        </div>
    );
}
