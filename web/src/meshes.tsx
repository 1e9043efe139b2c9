// Meshes: what was uploaded, its quality, what is wrong with it and how to mend it; label volumes.
import { useEffect, useMemo, useState } from 'preact/hooks';
import * as api from './api';
import { go, link } from './router';
import { jobs, mayChange, refreshJobs, say } from './state';
import { FORMATS, LongTable, Page, ProblemBox, Shown, figure, later, plural, size, useLoad } from './ui';
import { DropZone, Uploads } from './home';
import { aText, oneOf, useKept } from './kept';
import { nameOfMap } from './maps';
import { Delete, Rename } from './records';
import { batch, freeName } from './upload';
import { useValue } from './state';

const Shape = later<any>(() => import('./shape').then((m) => m.Shape));

/** Inputs of repair that would mend what the report names. */
export function mending(mesh: api.Mesh): api.Inputs<'repair'> | null {
    const inputs: api.Inputs<'repair'> = { mesh: mesh.id, orient: true, islands: true, duplicates: true, degenerate: true };
    const codes = mesh.report.problems.map((p) => p.code);
    const diagonal = mesh.report.boundingBoxDiagonal ?? 1;
    if (codes.some((c) => /closed|boundary|hole/.test(c))) inputs.holes = 10 * diagonal;
    if (codes.some((c) => /closed|boundary|manifold/.test(c))) inputs.merge = 1e-6 * diagonal;
    if (codes.some((c) => /genus/.test(c))) inputs.handles = 128;
    return codes.length ? inputs : null;
}

function Mend({ mesh, done }: { mesh: api.Mesh; done?: (id: string) => void }) {
    const [busy, setBusy] = useState(false);
    const [said, setSaid] = useState('');
    const inputs = mending(mesh);
    if (!inputs || !mayChange()) return null;
    const mend = async () => {
        setBusy(true);
        try {
            const answer = await api.run('repair', inputs);
            refreshJobs();
            if (answer.mesh.report.analysable) {
                say(`${mesh.name || mesh.id} was mended`);
                await api.send('patch', '/v1/meshes/{id}', { id: answer.mesh.id }, { name: `${mesh.name || 'mesh'} mended` });
                done?.(answer.mesh.id);
            } else setSaid(answer.mesh.report.problems[0]?.detail ?? 'It cannot be mended this way.');
        } catch (error) {
            setSaid((error as Error).message);
        }
        setBusy(false);
    };
    return (
        <>
            <button onClick={mend} disabled={busy} aria-label={`Repair ${mesh.name || mesh.id}`}>{busy ? 'Repairing…' : 'Repair'}</button>
            {said && <span class="wrong" title={said}> {said}</span>}
        </>
    );
}

export function Meshes() {
    const [items, setItems] = useState<api.Mesh[]>([]);
    const [loaded, setLoaded] = useState(false);
    const [error, setError] = useState<unknown>();
    const [find, setFind] = useKept('find', '', aText);
    const [only, setOnly] = useKept('only', '', oneOf(['good', 'bad']));
    const [chosen, setChosen] = useState<Set<string>>(new Set());
    const [round, setRound] = useState(0);
    const sending = useValue(batch)?.running;
    const made = useValue(jobs).filter((j) => j.status === 'successful' && /^(encode|extract|repair|mirror)$/.test(j.process)).length;
    const [fits, setFits] = useState<Map<string, number>>(new Map());
    useEffect(() => {
        let gone = false;
        api.listAll('meshes', setItems, () => gone).then(() => setLoaded(true), setError);
        // How near the last encoding of each came, where there is one.
        api.listAll('surfaces', (list) => setFits(new Map(list.flatMap((s): [string, number][] => {
            const { rms } = (s.fit?.relativeToDiagonal ?? {}) as { rms?: number };
            return s.source?.mesh && typeof rms === 'number' ? [[s.source.mesh, rms]] : [];
        }).reverse())), () => gone).catch(setError);
        return () => { gone = true; };
    }, [round, sending, made]);
    const cohorts = useLoad(() => api.list('cohorts', { limit: 200 }), []).value?.items ?? [];
    const shown = useMemo(() => {
        const text = find.toLowerCase();
        return items.filter((m) => (!only || (only === 'good') === m.report.analysable)
            && `${m.name} ${m.id} ${m.format} ${(m.tags ?? []).join(' ')}`.toLowerCase().includes(text));
    }, [items, find, only]);
    const good = items.filter((m) => m.report.analysable).length;
    const toggle = (id: string) => {
        const next = new Set(chosen);
        if (!next.delete(id)) next.add(id);
        setChosen(next);
    };
    const all = shown.length > 0 && shown.every((m) => chosen.has(m.id));
    const makeCohort = async () => {
        const from = items.filter((m) => m.report.analysable && (chosen.size === 0 || chosen.has(m.id)));
        try {
            const name = await freeName('cohort');
            await api.send('post', '/v1/cohorts', {}, { name, members: from.map((m) => ({ id: m.id })).reverse() });
            go(link('cohorts', name));
        } catch (e) {
            setError(e);
        }
    };
    const addTo = async (name: string) => {
        setError(undefined);
        const from = items.filter((m) => m.report.analysable && chosen.has(m.id));
        try {
            await api.send('patch', '/v1/cohorts/{name}', { name }, { add: from.map((m) => ({ id: m.id })).reverse() });
            go(link('cohorts', name));
        } catch (e) {
            setError(e);
        }
    };
    return (
        <Page title="Meshes" actions={mayChange() && good > 0 && (
            <>
                {chosen.size > 0 && <Delete kind="meshes" ids={[...chosen]} done={(kept) => { setChosen(new Set(kept)); setRound(round + 1); }} />}
                {chosen.size > 0 && cohorts.length > 0 && <label><span class="sr">Add to a cohort</span> <select value="" onChange={(e) => void addTo(e.currentTarget.value)}>
                    <option value="">Add {chosen.size} to…</option>{cohorts.map((c) => <option>{c.name}</option>)}
                </select></label>}
                <button class="main" onClick={makeCohort}>New cohort of {chosen.size || good}</button>
            </>
        )}>
            {mayChange() && <DropZone compact />}
            <Uploads />
            {error ? <ProblemBox error={error} /> : null}
            <div class="row tools">
                <label>Search <input type="search" value={find} onInput={(e) => setFind(e.currentTarget.value)} /></label>
                <label>Show <select value={only} onChange={(e) => setOnly(e.currentTarget.value)}>
                    <option value="">all</option><option value="good">can be analysed</option><option value="bad">to be mended</option>
                </select></label>
                <span class="quiet" role="status">{good} of {items.length.toLocaleString('en')} can be analysed{items.length > good ? `, ${items.length - good} to be mended` : ''}</span>
            </div>
            {items.length === 0 ? <p class="quiet">{loaded ? 'No meshes yet. Drop some above, or load the example from the start page.' : 'Loading…'}</p> : (
                <LongTable label="Meshes" items={shown} keyOf={(m) => m.id}
                    columns={[
                        { title: 'Chosen', hidden: true, width: '2.2rem' }, { title: 'Name', by: (m) => m.name || m.id }, { title: 'Faces', width: '5.5rem', by: (m) => m.faces }, { title: 'Size', width: '5rem', by: (m) => m.bytes },
                        { title: 'Route', width: '5rem', by: (m) => m.report.route }, { title: 'Star margin', width: '8rem', by: (m) => m.report.starShaped?.margin },
                        { title: 'Fit', width: '5rem', by: (m) => fits.get(m.id) }, { title: 'Repairs' }, { title: 'Problem', by: (m) => m.report.problems[0]?.code }, { title: 'Repair', hidden: true, width: '6rem' },
                    ]}
                    row={(m) => [
                        <input type="checkbox" checked={chosen.has(m.id)} onChange={() => toggle(m.id)} aria-label={`Choose ${m.name || m.id}`} />,
                        <a href={link('meshes', m.id)}>{m.name || m.id}</a>,
                        m.faces.toLocaleString('en'), size(m.bytes), m.report.route ?? '–', figure(m.report.starShaped?.margin),
                        fits.has(m.id) ? `${figure(100 * fits.get(m.id)!, 2)} %` : '–',
                        m.report.repairs.map((r) => `${r.code} ${r.count}`).join(', ') || '–',
                        m.report.problems[0] ? <span class="wrong" title={m.report.problems[0].detail}>{m.report.problems[0].code}: {m.report.problems[0].detail}</span> : '–',
                        m.report.analysable ? null : <Mend mesh={m} done={() => setRound(round + 1)} />,
                    ]} />
            )}
            {items.length > 0 && <p class="quiet">Route: how a mesh is mapped to the sphere. Star margin: above 0 one point inside sees all of the surface. Fit: how far the encoding is from the mesh (root mean square), as a share of its diagonal; – until it is encoded by itself.</p>}
            {shown.length > 0 && (
                <p><button onClick={() => setChosen(new Set(all ? [] : shown.map((m) => m.id)))}>{all ? 'Choose none' : `Choose all ${shown.length.toLocaleString('en')} shown`}</button></p>
            )}
        </Page>
    );
}

export function MeshPage({ id }: { id: string }) {
    const mesh = useLoad((signal) => api.get('/v1/meshes/{id}', { id }, signal), [id]);
    const listed = useLoad(() => api.list('surfaces', { mesh: id, process: 'encode', limit: 200 }), [id]);
    const encodings = (listed.value?.items ?? []).filter((s) => s.source?.mesh === id && !s.mirrored);
    const [over, setOver] = useKept('with', '', aText);
    const chosen = encodings.find((s) => s.id === over);
    return (
        <Shown of={mesh} page label="the mesh">{(m) => (
            <Page title={m.name || m.id} actions={<>
                <Mend mesh={m} done={(made) => go(link('meshes', made))} />
                <Rename kind="meshes" id={id} name={m.name} done={mesh.reload} />
                <Delete kind="meshes" ids={[id]} name={m.name || m.id} done={(kept) => kept.length || go('#/meshes')} />
            </>}>
                <div class="split">
                    <Shape src={`/v1/meshes/${id}/content?format=glb`} mesh={id} unit="mm" label={`Mesh ${m.name}`} marks={m.report.problems}
                        name={m.name || m.id} downloads={FORMATS.map((f) => [f, `/v1/meshes/${id}/content?format=${f}`])} over={chosen && `/v1/surfaces/${chosen.id}/mesh?format=glb&resolution=32&space=original`} />
                    <div>
                        {encodings.length > 0 && (
                            <p><label>With its encoding <select value={chosen ? over : ''} onChange={(e) => setOver(e.currentTarget.value)}>
                                <option value="">none</option>{encodings.map((s) => <option value={s.id}>{`degree ${s.lmax}, ${s.name || s.id}`}</option>)}
                            </select></label></p>
                        )}
                        {chosen && <p class="quiet">Blue: the surface that degree {chosen.lmax} can hold. The map “{nameOfMap('between')}” shows what was lost.</p>}
                        {m.report.problems.map((p) => (
                            <div class="problem"><strong>{p.code}</strong><p>{p.detail}</p></div>
                        ))}
                        <dl class="pairs">
                            <dt>Vertices, faces</dt><dd>{m.vertices.toLocaleString('en')}, {m.faces.toLocaleString('en')}</dd>
                            <dt>Area</dt><dd>{figure(m.report.area, 5)} mm²</dd>
                            <dt>Volume</dt><dd>{figure(m.report.volume, 5)} mm³ <span class="quiet">(the unit of the file is taken to be the millimetre)</span></dd>
                            <dt>Closed, genus, parts</dt><dd>{m.report.closed ? 'closed' : 'open'}, {m.report.genus ?? '–'}, {m.report.components}</dd>
                            <dt>Route</dt><dd>{m.report.route ?? '–'}{m.report.starShaped?.value ? ', star-shaped' : ''}</dd>
                            <dt>Repairs when read</dt><dd>{m.report.repairs.map((r) => `${r.code}: ${r.count}`).join(', ') || 'none'}</dd>
                            <dt>Id</dt><dd><code>{m.id}</code></dd>
                        </dl>
                        {mayChange() && m.report.analysable && <a class="button main" href={`${link('analyses', 'encode')}?mesh=${m.id}`}>Encode as a surface</a>}
                    </div>
                </div>
            </Page>
        )}</Shown>
    );
}

/** Labels of a segmentation, each of which becomes a mesh. */
export function Volume({ id }: { id: string }) {
    const volume = useLoad(() => api.get('/v1/volumes/{id}', { id }), [id]);
    const [chosen, setChosen] = useState<Set<number>>(new Set());
    const [error, setError] = useState<unknown>();
    const extract = async () => {
        try {
            for (const label of chosen) await api.execute('extract', { volume: id, labels: [label] }, `Label ${label}`);
            refreshJobs();
            go('#/meshes');
        } catch (e) {
            setError(e);
        }
    };
    return (
        <Shown of={volume} page label="the segmentation">{(v) => (
            <Page title={v.name || 'Segmentation'} actions={<>
                <Rename kind="volumes" id={id} name={v.name} done={volume.reload} />
                <Delete kind="volumes" ids={[id]} name={v.name || v.id} done={(kept) => kept.length || go('#/meshes')} />
            </>}>
                <p>Choose the labels that become meshes, one of each.</p>
                {error ? <ProblemBox error={error} /> : null}
                <fieldset><legend>Labels</legend>
                    {(v.labels ?? []).map((l) => (
                        <label class="check"><input type="checkbox" checked={chosen.has(l.value)} onChange={() => setChosen((before) => {
                            const next = new Set(before);
                            if (!next.delete(l.value)) next.add(l.value);
                            return next;
                        })} /> {l.value}{l.name ? ` ${l.name}` : ''} <span class="quiet">{l.voxels.toLocaleString('en')} voxels</span></label>
                    ))}
                </fieldset>
                <p><button onClick={() => setChosen(new Set(chosen.size ? [] : (v.labels ?? []).map((l) => l.value)))}>{chosen.size ? 'Choose none' : 'Choose all'}</button></p>
                {mayChange() && <button class="main" disabled={!chosen.size} onClick={extract}>Make {plural(chosen.size, 'mesh', 'meshes')}</button>}
            </Page>
        )}</Shown>
    );
}
