// What can be done with a record of the service, be it a mesh, a surface, a segmentation or a model: give it another
// name, and delete it, alone or with what needs it.
import { useRef, useState } from 'preact/hooks';
import * as api from './api';
import { t } from './i18n';
import { link } from './router';
import { jobs, mayChange, say } from './state';
import { ProblemBox, plural } from './ui';

export type Kind = 'meshes' | 'surfaces' | 'volumes' | 'models';
const ONE: Record<Kind, string> = { meshes: 'mesh', surfaces: 'surface', volumes: 'segmentation', models: 'model' };
const PLACES: Record<string, string> = { mesh: 'meshes', surface: 'shapes', model: 'models', job: 'jobs', cohort: 'cohorts' };

/** Asks for another name, which the page shows from then on. */
export function Rename({ kind, id, name, done }: { kind: Kind; id: string; name: string; done: () => void }) {
    const dialog = useRef<HTMLDialogElement>(null);
    const [text, setText] = useState(name);
    const [error, setError] = useState<unknown>();
    if (!mayChange()) return null;
    const rename = async (event: Event) => {
        event.preventDefault();
        setError(undefined);
        try {
            await api.send('patch', `/v1/${kind}/{id}`, { id }, { name: text.trim() });
            dialog.current!.close();
            done();
        } catch (e) {
            setError(e);
        }
    };
    return (
        <>
            <button onClick={() => { setText(name); setError(undefined); dialog.current!.showModal(); }}>{t`Rename`}</button>
            <dialog ref={dialog} aria-label={t`Another name for the ${ONE[kind]}`}>
                <form onSubmit={rename}>
                    <label>{t`Name`} <input type="text" value={text} required maxLength={255} onInput={(e) => setText(e.currentTarget.value)} /></label>
                    {error ? <ProblemBox error={error} /> : null}
                    <div class="actions"><button class="main">{t`Rename`}</button><button type="button" onClick={() => dialog.current!.close()}>{t`Keep`}</button></div>
                </form>
            </dialog>
        </>
    );
}

export const isInUse = (error: unknown): boolean => error instanceof api.Failure && error.problem.code === 'in-use';

/** Deletes records one after the other; those that something needs are left, unless that is to go too. */
async function removeAll(kind: Kind, ids: string[], cascade: boolean): Promise<{ kept: string[]; why: api.Problem[] }> {
    const kept: string[] = [];
    const why: api.Problem[] = [];
    for (const id of ids) {
        try {
            await api.request(`/v1/${kind}/${encodeURIComponent(id)}${cascade ? '?cascade=true' : ''}`, { method: 'DELETE' });
        } catch (error) {
            const { problem } = error as api.Failure;
            if (problem?.status === 404) continue; // what went with another
            if (!isInUse(error)) throw error;
            kept.push(id);
            why.push(problem);
        }
    }
    return { kept, why };
}

/** What would go too, by its kind; jobs by their names, where these are known. */
function Needing({ why }: { why: api.Problem[] }) {
    const known = new Map(why.flatMap((p) => p.neededBy ?? []).map((n) => [`${n.kind} ${n.id}`, n]));
    const more = Math.max(0, ...why.map((p) => (p.neededByCount ?? 0) - (p.neededBy?.length ?? 0)));
    const nameOf = (kind: string, id: string) => (kind === 'job' ? jobs.get().find((j) => j.id === id)?.name || id : id);
    const kinds = [...new Set([...known.values()].map((n) => n.kind))];
    return (
        <ul>
            {kinds.map((kind) => {
                const all = [...known.values()].filter((n) => n.kind === kind);
                return (
                    <li>{plural(all.length, kind, kind === 'mesh' ? 'meshes' : `${kind}s`)}
                        {kind === 'surface' ? '' : <>: {all.map((n, i) => <>{i ? ', ' : ''}<a href={link(PLACES[n.kind], n.id)}>{nameOf(n.kind, n.id)}</a></>)}</>}</li>
                );
            })}
            {more > 0 && <li>{t`${more} more`}</li>}
        </ul>
    );
}

/** Asks first; where something needs what is to go, says what, and offers to delete that with it. */
export function Delete({ kind, ids, name, done }: {
    kind: Kind; ids: string[]; name?: string;
    /** With those that are still there. */
    done: (kept: string[]) => void;
}) {
    const dialog = useRef<HTMLDialogElement>(null);
    const [left, setLeft] = useState<{ kept: string[]; why: api.Problem[] }>();
    const [busy, setBusy] = useState(false);
    const [error, setError] = useState<unknown>();
    if (!mayChange()) return null;
    const what = ids.length === 1 && name ? name : plural(ids.length, ONE[kind], kind === 'meshes' ? 'meshes' : `${ONE[kind]}s`);
    const close = (kept?: string[]) => {
        dialog.current!.close();
        setLeft(undefined);
        if (kept) done(kept);
    };
    const remove = async (which: string[], cascade: boolean) => {
        setBusy(true);
        setError(undefined);
        try {
            const found = await removeAll(kind, which, cascade);
            const gone = which.length - found.kept.length;
            if (gone) say(t`${plural(gone, ONE[kind], kind === 'meshes' ? 'meshes' : `${ONE[kind]}s`)} deleted`);
            if (found.kept.length) setLeft(found);
            else close([]);
        } catch (e) {
            setError(e);
        }
        setBusy(false);
    };
    return (
        <>
            <button class="risky" onClick={() => { setLeft(undefined); setError(undefined); dialog.current!.showModal(); }}>{name ? t`Delete` : t`Delete ${ids.length}`}</button>
            <dialog ref={dialog} aria-label={t`Delete ${what}?`} onCancel={() => left && done(left.kept)}>
                {left ? (
                    <>
                        <p><strong>{left.kept.length === 1 && name ? t`${name} is needed` : t`${left.kept.length} of ${ids.length} stay: they are needed`}</strong> {t`by`}</p>
                        <Needing why={left.why} />
                        <p>{t`These can be deleted with ${left.kept.length === 1 ? t`it` : t`them`}. That is final.`}</p>
                    </>
                ) : <p>{t`Delete ${what}? That is final.`}</p>}
                {error ? <ProblemBox error={error} /> : null}
                <div class="actions">
                    {left ? <button class="risky" disabled={busy} onClick={() => void remove(left.kept, true)}>{t`Delete all of that`}</button>
                        : <button class="risky" disabled={busy} onClick={() => void remove(ids, false)}>{busy ? t`Deleting…` : t`Delete`}</button>}
                    <button autofocus onClick={() => close(left?.kept)}>{t`Keep`}</button>
                </div>
            </dialog>
        </>
    );
}
