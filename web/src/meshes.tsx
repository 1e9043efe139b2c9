// Meshes: what was uploaded, its quality, what is wrong with it and how to mend it; label volumes.
import { useEffect, useMemo, useState } from 'preact/hooks';
import * as api from './api';
import { fromHere, go, link } from './router';
import { jobs, mayChange, refreshJobs, say } from './state';
import { FORMATS, LongTable, Page, ProblemBox, Shown, figure, later, plural, size, useLoad } from './ui';
import { DropZone, Uploads } from './home';
import { t, whole } from './i18n';
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

function Mend({ mesh, done }: { mesh: api.Mesh; done?: (id: string, onward: (href: string) => void) => void }) {
    const [busy, setBusy] = useState(false);
    const [said, setSaid] = useState('');
    const inputs = mending(mesh);
    if (!inputs || !mayChange()) return null;
    const mend = async () => {
        setBusy(true);
        const onward = fromHere();
        try {
            const answer = await api.run('repair', inputs);
            refreshJobs();
            if (answer.mesh.report.analysable) {
                say(t`${mesh.name || mesh.id} was mended`);
                await api.send('patch', '/v1/meshes/{id}', { id: answer.mesh.id }, { name: `${mesh.name || 'mesh'} mended` });
                done?.(answer.mesh.id, onward);
            } else setSaid(answer.mesh.report.problems[0]?.detail ?? t`It cannot be mended this way.`);
        } catch (error) {
            setSaid((error as Error).message);
        }
        setBusy(false);
    };
    return (
        <>
            <button onClick={mend} disabled={busy} aria-label={t`Repair ${mesh.name || mesh.id}`}>{busy ? t`Repairing…` : t`Repair`}</button>
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
        const onward = fromHere();
        try {
            const name = await freeName('cohort');
            await api.send('post', '/v1/cohorts', {}, { name, members: from.map((m) => ({ id: m.id })).reverse() });
            onward(link('cohorts', name));
        } catch (e) {
            setError(e);
        }
    };
    const addTo = async (name: string) => {
        setError(undefined);
        const from = items.filter((m) => m.report.analysable && chosen.has(m.id));
        const onward = fromHere();
        try {
            await api.send('patch', '/v1/cohorts/{name}', { name }, { add: from.map((m) => ({ id: m.id })).reverse() });
            onward(link('cohorts', name));
        } catch (e) {
            setError(e);
        }
    };
    return (
        <Page title={t`Meshes`} actions={mayChange() && good > 0 && (
            <>
                {chosen.size > 0 && <Delete kind="meshes" ids={[...chosen]} done={(kept) => { setChosen(new Set(kept)); setRound(round + 1); }} />}
                {chosen.size > 0 && cohorts.length > 0 && <label><span class="sr">{t`Add to a cohort`}</span> <select value="" onChange={(e) => void addTo(e.currentTarget.value)}>
                    <option value="">{t`Add ${chosen.size} to…`}</option>{cohorts.map((c) => <option>{c.name}</option>)}
                </select></label>}
                <button class="main" onClick={makeCohort}>{t`New cohort of ${chosen.size || good}`}</button>
            </>
        )}>
            {mayChange() && <DropZone compact />}
            <Uploads />
            {error ? <ProblemBox error={error} /> : null}
            <div class="row tools">
                <label>{t`Search`} <input type="search" value={find} onInput={(e) => setFind(e.currentTarget.value)} /></label>
                <label>{t`Show`} <select value={only} onChange={(e) => setOnly(e.currentTarget.value)}>
                    <option value="">{t`all`}</option><option value="good">{t`can be analysed`}</option><option value="bad">{t`to be mended`}</option>
                </select></label>
                <span class="quiet" role="status">{t`${good} of ${whole(items.length)} can be analysed${items.length > good ? t`, ${items.length - good} to be mended` : ''}`}</span>
            </div>
            {items.length === 0 ? <p class="quiet">{loaded ? t`No meshes yet. Drop some above, or load the example from the start page.` : t`Loading…`}</p> : (
                <LongTable label={t`Meshes`} items={shown} keyOf={(m) => m.id}
                    columns={[
                        ...(mayChange() ? [{ title: t`Chosen`, hidden: true, width: '2.2rem' }] : []), { title: t`Name`, by: (m) => m.name || m.id }, { title: t`Faces`, width: '5.5rem', by: (m) => m.faces }, { title: t`Size`, width: '5rem', by: (m) => m.bytes },
                        { title: t`Route`, width: '5rem', by: (m) => m.report.route }, { title: t`Star margin`, width: '8rem', by: (m) => m.report.starShaped?.margin },
                        { title: t`Fit`, width: '5rem', by: (m) => fits.get(m.id) }, { title: t`Repairs` }, { title: t`Problem`, by: (m) => m.report.problems[0]?.code }, { title: t`Repair`, hidden: true, width: '6rem' },
                    ]}
                    row={(m) => [
                        ...(mayChange() ? [<input type="checkbox" checked={chosen.has(m.id)} onChange={() => toggle(m.id)} aria-label={t`Choose ${m.name || m.id}`} />] : []),
                        <a href={link('meshes', m.id)}>{m.name || m.id}</a>,
                        whole(m.faces), size(m.bytes), m.report.route ?? '–', figure(m.report.starShaped?.margin),
                        fits.has(m.id) ? `${figure(100 * fits.get(m.id)!, 2)} %` : '–',
                        m.report.repairs.map((r) => `${r.code} ${r.count}`).join(', ') || '–',
                        m.report.problems[0] ? <span class="wrong" title={m.report.problems[0].detail}>{m.report.problems[0].code}: {m.report.problems[0].detail}</span> : '–',
                        m.report.analysable ? null : <Mend mesh={m} done={() => setRound(round + 1)} />,
                    ]} />
            )}
            {items.length > 0 && <p class="quiet">{t`Route: how a mesh is mapped to the sphere. Star margin: above 0 one point inside sees all of the surface. Fit: how far the encoding is from the mesh (root mean square), as a share of its diagonal; – until it is encoded by itself.`}</p>}
            {mayChange() && shown.length > 0 && (
                <p><button onClick={() => setChosen(new Set(all ? [] : shown.map((m) => m.id)))}>{all ? t`Choose none` : t`Choose all ${whole(shown.length)} shown`}</button></p>
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
        <Shown of={mesh} page label={t`the mesh`}>{(m) => (
            <Page title={m.name || m.id} actions={<>
                <Mend mesh={m} done={(made, onward) => onward(link('meshes', made))} />
                <Rename kind="meshes" id={id} name={m.name} done={mesh.reload} />
                <Delete kind="meshes" ids={[id]} name={m.name || m.id} done={(kept) => kept.length || go('#/meshes')} />
            </>}>
                <div class="split">
                    <Shape src={`/v1/meshes/${id}/content?format=glb`} mesh={id} unit="mm" label={t`Mesh ${m.name}`} marks={m.report.problems}
                        name={m.name || m.id} downloads={FORMATS.map((f) => [f, `/v1/meshes/${id}/content?format=${f}`])} over={chosen && `/v1/surfaces/${chosen.id}/mesh?format=glb&resolution=32&space=original`} />
                    <div>
                        {encodings.length > 0 && (
                            <p><label>{t`With its encoding`} <select value={chosen ? over : ''} onChange={(e) => setOver(e.currentTarget.value)}>
                                <option value="">{t`none`}</option>{encodings.map((s) => <option value={s.id}>{t`degree ${s.lmax}, ${s.name || s.id}`}</option>)}
                            </select></label></p>
                        )}
                        {chosen && <p class="quiet">{t`Blue: the surface that degree ${chosen.lmax} can hold. The map “${nameOfMap('between')}” shows what was lost.`}</p>}
                        {m.report.problems.map((p) => (
                            <div class="problem"><strong>{p.code}</strong><p>{p.detail}</p></div>
                        ))}
                        <dl class="pairs">
                            <dt>{t`Vertices, faces`}</dt><dd>{whole(m.vertices)}, {whole(m.faces)}</dd>
                            <dt>{t`Area`}</dt><dd>{t`${figure(m.report.area, 5)} mm²`}</dd>
                            <dt>{t`Volume`}</dt><dd>{t`${figure(m.report.volume, 5)} mm³`} <span class="quiet">{t`(the unit of the file is taken to be the millimetre)`}</span></dd>
                            <dt>{t`Closed, genus, parts`}</dt><dd>{m.report.closed ? t`closed` : t`open`}, {m.report.genus ?? '–'}, {m.report.components}</dd>
                            <dt>{t`Route`}</dt><dd>{m.report.route ?? '–'}{m.report.starShaped?.value ? t`, star-shaped` : ''}</dd>
                            <dt>{t`Repairs when read`}</dt><dd>{m.report.repairs.map((r) => `${r.code}: ${r.count}`).join(', ') || t`none`}</dd>
                            <dt>{t`Id`}</dt><dd><code>{m.id}</code></dd>
                        </dl>
                        {mayChange() && m.report.analysable && <a class="button main" href={`${link('analyses', 'encode')}?mesh=${m.id}`}>{t`Encode as a surface`}</a>}
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
        const onward = fromHere();
        try {
            for (const label of chosen) await api.execute('extract', { volume: id, labels: [label] }, `Label ${label}`);
            refreshJobs();
            onward('#/meshes');
        } catch (e) {
            setError(e);
        }
    };
    return (
        <Shown of={volume} page label={t`the segmentation`}>{(v) => (
            <Page title={v.name || t`Segmentation`} actions={<>
                <Rename kind="volumes" id={id} name={v.name} done={volume.reload} />
                <Delete kind="volumes" ids={[id]} name={v.name || v.id} done={(kept) => kept.length || go('#/meshes')} />
            </>}>
                <p>{t`Choose the labels that become meshes, one of each.`}</p>
                {error ? <ProblemBox error={error} /> : null}
                <fieldset><legend>{t`Labels`}</legend>
                    {(v.labels ?? []).map((l) => (
                        <label class="check"><input type="checkbox" checked={chosen.has(l.value)} onChange={() => setChosen((before) => {
                            const next = new Set(before);
                            if (!next.delete(l.value)) next.add(l.value);
                            return next;
                        })} /> {l.value}{l.name ? ` ${l.name}` : ''} <span class="quiet">{t`${whole(l.voxels)} voxels`}</span></label>
                    ))}
                </fieldset>
                <p><button onClick={() => setChosen(new Set(chosen.size ? [] : (v.labels ?? []).map((l) => l.value)))}>{chosen.size ? t`Choose none` : t`Choose all`}</button></p>
                {mayChange() && <button class="main" disabled={!chosen.size} onClick={extract}>{t`Make ${plural(chosen.size, 'mesh', 'meshes')}`}</button>}
            </Page>
        )}</Shown>
    );
}
