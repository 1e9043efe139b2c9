// Surfaces: what encodings and analyses made.
import { useEffect, useState } from 'preact/hooks';
import * as api from './api';
import { t } from './i18n';
import { aText, useKept } from './kept';
import { Delete, Rename } from './records';
import { go, link } from './router';
import { mayChange } from './state';
import { FORMATS, LongTable, Page, ProblemBox, Shown, figure, useLoad, when } from './ui';
import { Shape, originalPath, shapePath, surfacePath } from './shape';

export function Surfaces() {
    const [items, setItems] = useState<api.Surface[]>([]);
    const [loaded, setLoaded] = useState(false);
    const [error, setError] = useState<unknown>();
    const [find, setFind] = useKept('find', '', aText);
    const [chosen, setChosen] = useState<Set<string>>(new Set());
    const [round, setRound] = useState(0);
    useEffect(() => {
        let gone = false;
        api.listAll('surfaces', setItems, () => gone).then(() => setLoaded(true), setError);
        return () => { gone = true; };
    }, [round]);
    const toggle = (id: string) => {
        const next = new Set(chosen);
        if (!next.delete(id)) next.add(id);
        setChosen(next);
    };
    const shown = items.filter((s) => `${s.name} ${s.id} ${s.source?.process ?? ''}`.toLowerCase().includes(find.toLowerCase()));
    return (
        <Page title={t`Shapes`} actions={chosen.size > 0 && <Delete kind="surfaces" ids={[...chosen]} done={(kept) => { setChosen(new Set(kept)); setRound(round + 1); }} />}>
            {error ? <ProblemBox error={error} /> : null}
            <div class="row tools"><label>{t`Search`} <input type="search" value={find} onInput={(e) => setFind(e.currentTarget.value)} /></label></div>
            {shown.length === 0 ? <p class="quiet">{loaded ? t`No surface. Analyses make them: encodings of meshes, means, modes, paths.` : t`Loading…`}</p> : (
                <LongTable label={t`Surfaces`} items={shown} keyOf={(s) => s.id}
                    columns={[...(mayChange() ? [{ title: t`Chosen`, hidden: true, width: '2.2rem' }] : []), { title: t`Name`, by: (s) => s.name || s.id }, { title: t`Made by`, width: '11rem', by: (s) => s.source?.process }, { title: t`Degree`, width: '6rem', by: (s) => s.lmax },
                        { title: t`Route`, width: '6rem', by: (s) => s.route }, { title: t`Made`, width: '14rem', by: (s) => s.created }]}
                    row={(s) => [...(mayChange() ? [<input type="checkbox" checked={chosen.has(s.id)} onChange={() => toggle(s.id)} aria-label={t`Choose ${s.name || s.id}`} />] : []), <a href={link('shapes', s.id)}>{s.name || s.id}</a>, s.source?.process ?? '–', s.lmax, s.route ?? '–', when(s.created)]} />
            )}
        </Page>
    );
}

/** Surfaces are laid over each other in their common size and pose, a mesh over its encoding as both were sent. */
const posed = (over: string): boolean => over !== '' && !over.startsWith('mesh-');

export function SurfacePage({ id }: { id: string }) {
    const others = useLoad(() => api.list('surfaces', { limit: 200 }), []);
    const [over, setOver] = useKept('with', '', aText);
    const surface = useLoad((signal) => api.get('/v1/surfaces/{id}', { id }, signal), [id]);
    return (
        <Shown of={surface} page label={t`the surface`}>{(s) => (
            <Page title={s.name || s.id} actions={<>
                <Rename kind="surfaces" id={id} name={s.name} done={surface.reload} />
                <Delete kind="surfaces" ids={[id]} name={s.name || s.id} done={(kept) => kept.length || go('#/shapes')} />
            </>}>
                <div class="split">
                    <Shape src={posed(over) ? surfacePath(id, 32) : originalPath(id)} unit={posed(over) || !s.scale ? undefined : 'mm'} label={t`Surface ${s.name}`} name={s.name || s.id} over={over ? (posed(over) ? surfacePath(over, 32) : shapePath(over)) : undefined}
                        downloads={FORMATS.map((f) => [f, `/v1/surfaces/${id}/mesh?format=${f}&resolution=48`])} />
                    <dl class="pairs">
                        <dt><label for="over">{t`With`}</label></dt>
                        <dd><select id="over" value={over} onChange={(e) => setOver(e.currentTarget.value)}>
                            <option value="">{t`no other surface`}</option>
                            {s.source?.mesh && !s.mirrored && <option value={s.source.mesh}>{t`the mesh that it encodes`}</option>}
                            {(others.value?.items ?? []).filter((o) => o.id !== id).map((o) => <option value={o.id}>{o.name || o.id}</option>)}
                        </select></dd>
                        <dt>{t`Degree`}</dt><dd>{s.lmax}</dd>
                        <dt>{t`Area, volume`}</dt><dd>{t`${figure(s.area === null ? null : s.area * s.scale ** 2, 5)} mm², ${figure(s.volume === null ? null : s.volume * s.scale ** 3, 5)} mm³`} <span class="quiet">{t`(the unit of the files is taken to be the millimetre)`}</span></dd>
                        <dt>{t`Route`}</dt><dd>{s.route ?? s.parameterization}</dd>
                        {s.fit && <><dt>{t`Fit (rms of the diagonal)`}</dt><dd>{figure((s.fit.relativeToDiagonal as { rms?: number } | undefined)?.rms)}</dd></>}
                        <dt>{t`Made by`}</dt><dd>{s.source?.job ? <a href={link('jobs', s.source.job)}>{s.source.process}</a> : s.source?.process ?? '–'}
                            {s.source?.mesh && <> {t`of`} <a href={link('meshes', s.source.mesh)}>{t`a mesh`}</a></>}</dd>
                        <dt>{t`Made`}</dt><dd>{when(s.created)}</dd>
                        <dt>{t`Id`}</dt><dd><code>{s.id}</code></dd>
                    </dl>
                </div>
            </Page>
        )}</Shown>
    );
}
