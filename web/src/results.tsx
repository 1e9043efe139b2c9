// What analyses found, each in the form that answers its question; and the report of it.
import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import * as api from './api';
import { Confusion, Curve, DataTable, HeatMap, Intervals, Scatter, Spread, Variance, scaling } from './charts';
import { link } from './router';
import { mayChange, refreshJobs } from './state';
import { normalsOf } from './geometry';
import { ColourBar, mapOf, paintedBy } from './maps';
import { PictureButtons, Shape, View, linked, shapeAt, shapePath, surfacePath, useShape } from './shape';
import { Camera, moved } from './stage';
import { Findings } from './findings';
import { Page, ProblemBox, Shown, csv, figure, plural, save, size, useLoad } from './ui';
import { makeReport } from './report';

function Warnings({ list }: { list?: { code: string; detail: string }[] }) {
    if (!list?.length) return null;
    return (
        <section class="warning" aria-label="Warnings">
            <strong>Reasons to doubt</strong>
            <ul>{list.map((w) => <li><code>{w.code}</code> {w.detail}</li>)}</ul>
        </section>
    );
}

/** A shape in a view that turns with the others, or a word that it comes. */
export function Linked({ id, title, resolution = 24, colour }: { id: string; title: string; resolution?: number; colour?: string }) {
    const { shape, error } = useShape(shapePath(id, resolution));
    const own = useMemo(() => new Camera(), []);
    const [alone, setAlone] = useState(false);
    if (error) return <ProblemBox error={error} />;
    return (
        <figure class="shape">
            {shape ? <View parts={[{ shape, colour }]} camera={alone ? own : linked} label={title} onLink={() => setAlone(!alone)} />
                : <div class="view" aria-busy="true" />}
            <figcaption>{title}{alone ? ' (turns alone)' : ''}</figcaption>
        </figure>
    );
}

// ---- Components --------------------------------------------------------------------------------------------------------

/** Positions at each keyframe, and how far off each is: the nearest shape against the point asked for. */
interface Frames { positions: Float32Array[]; offsets: number[] }
interface Exact { at: Record<number, number>; positions: Float32Array; offset: number; energy: number }

const RESOLUTION = 24;

/** The shape at a point of a model, as the service computes it; nothing is stored. */
async function shapeOf(model: string, coefficients: number[], signal?: AbortSignal): Promise<Omit<Exact, 'at'>> {
    const response = await api.request(`/v1/models/${model}/shape?coefficients=${coefficients.join(',')}&format=positions&resolution=${RESOLUTION}`, { signal });
    const number = (name: string) => Number(response.headers.get(name));
    return { positions: new Float32Array(await response.arrayBuffer()), offset: number('Srnfd-Offset'), energy: number('Srnfd-Relative-Energy') };
}

const existence = (offset: number): string =>
    offset < 0.1 ? 'this shape exists' : offset <= 0.5 ? `the shape shown is the nearest that exists, ${Math.round(100 * offset)} % of the way off`
        : 'such a shape does not exist; this is the nearest one';

/** Cubic through four of the keyframes at equal distances. */
export function weights(t: number): [number, number][] {
    const x = Math.max(-3, Math.min(3, t)) + 3;
    const first = Math.max(0, Math.min(3, Math.floor(x) - 1));
    return [0, 1, 2, 3].map((k) => {
        let w = 1;
        for (let j = 0; j < 4; j++) if (j !== k) w *= (x - first - j) / (k - j);
        return [first + k, w];
    });
}

function Modes({ model }: { model: api.Model }) {
    const mean = useShape(surfacePath(model.mean.id));
    const frames = useRef(new Map<number, Frames>());
    const [loading, setLoading] = useState<number | null>(null);
    const [at, setAt] = useState<Record<number, number>>({});
    const [shown, setShown] = useState(Math.min(3, model.components));
    const [version, setVersion] = useState(0);
    const [error, setError] = useState<unknown>();
    const [playing, setPlaying] = useState(0);
    const [exact, setExact] = useState<Exact | null>(null);
    const asked = useRef<AbortController | null>(null);
    const moving = useMemo(() => mean.shape && { ...mean.shape, positions: mean.shape.positions.slice(), normals: mean.shape.normals.slice(), fields: [] }, [mean.shape]);
    const coming = useRef(new Map<number, Promise<boolean>>());
    const load = (mode: number): Promise<boolean> => {
        if (!coming.current.has(mode)) coming.current.set(mode, loadFrames(mode));
        return coming.current.get(mode)!;
    };
    const loadFrames = async (mode: number): Promise<boolean> => {
        setLoading(mode);
        try {
            const none = new Array(mode - 1).fill(0);
            const made: Frames = { positions: [], offsets: [] };
            // Two at a time: a browser opens six connections to a host, and others want some.
            for (const pair of [[-3, -2], [-1, 1], [2, 3]])
                for (const one of await Promise.all(pair.map(async (c) => ({ c, ...(await shapeOf(model.id, [...none, c])) })))) {
                    made.positions[one.c + 3] = one.positions;
                    made.offsets[one.c + 3] = one.offset;
                }
            made.positions[3] = mean.shape!.positions;
            made.offsets[3] = 0;
            frames.current.set(mode, made);
            setLoading(null);
            return true;
        } catch (e) {
            setError(e);
            setLoading(null);
            coming.current.delete(mode);
            return false;
        }
    };
    useEffect(() => {
        if (!moving || !mean.shape) return;
        const found = exact?.at === at ? exact : null;
        moving.positions.set(found ? found.positions : mean.shape.positions);
        for (const [mode, value] of found ? [] : Object.entries(at)) {
            const given = frames.current.get(+mode);
            if (!given || value === 0) continue;
            const middle = given.positions[3];
            for (const [k, w] of weights(value)) {
                const from = given.positions[k];
                for (let i = 0; i < middle.length; i++) moving.positions[i] += w * (from[i] - middle[i]);
            }
        }
        normalsOf(moving);
        moved(moving);
        setVersion((v) => v + 1);
    }, [at, moving, loading, exact]);
    useEffect(() => {
        if (!playing) return;
        let frame = 0;
        const start = performance.now();
        const step = (now: number) => {
            setAt((a) => ({ ...a, [playing]: 2 * Math.sin((now - start) / 900) }));
            frame = requestAnimationFrame(step);
        };
        frame = requestAnimationFrame(step);
        return () => cancelAnimationFrame(frame);
    }, [playing]);
    const slide = async (mode: number, value: number) => {
        setAt((a) => ({ ...a, [mode]: value }));
        await load(mode);
    };
    const active = Object.entries(at).filter(([, v]) => v !== 0);
    /** A slider was let go: the shape of all coefficients together, without interpolation. */
    const release = async (mode: number, value: number) => {
        const where = { ...at, [mode]: value };
        setAt(where);
        asked.current?.abort();
        const coefficients = Array.from({ length: Math.max(...Object.keys(where).map(Number)) }, (_, i) => where[i + 1] ?? 0);
        if (coefficients.every((c) => c === 0)) return;
        asked.current = new AbortController();
        try {
            setExact({ at: where, ...(await shapeOf(model.id, coefficients, asked.current.signal)) });
        } catch (e) {
            if ((e as Error).name !== 'AbortError') setError(e);
        }
    };
    const known = exact?.at === at ? exact : null;
    const doubt = active.map(([mode, v]) => {
        const k = Math.round(v) || Math.sign(v);
        const off = frames.current.get(+mode)?.offsets[k + 3];
        return off === undefined ? null : { mode, k, off };
    }).filter((d): d is { mode: string; k: number; off: number } => d !== null);
    return (
        <section aria-label="Components">
            <h2>Mean and components</h2>
            <div class="split">
                <figure class="shape">
                    {moving ? <View parts={[{ shape: moving }]} camera={linked} version={version} label={active.length ? `Shape at ${active.map(([m, v]) => `component ${m}: ${figure(v)} standard deviations`).join(', ')}` : 'Mean shape'} />
                        : <div class="view" aria-busy="true" />}
                    <figcaption class="row">
                        {active.length ? active.map(([m, v]) => `component ${m}: ${v > 0 ? '+' : ''}${figure(v)} sd`).join(', ') : 'mean'}
                        {moving && <span class="no-report"><PictureButtons parts={[{ shape: moving }]} camera={linked} name="mode" /></span>}
                    </figcaption>
                </figure>
                <div class="no-report">
                    {Array.from({ length: shown }, (_, i) => i + 1).map((mode) => (
                        <div class="field" key={mode}>
                            <label for={`mode-${mode}`}>Component {mode} <span class="quiet">{Math.round(100 * model.explained[mode - 1])} % of the variance, now {figure(at[mode] ?? 0)} sd{loading === mode ? ', loading…' : ''}</span></label>
                            <div class="row">
                                <div class="grow track">
                                    <input id={`mode-${mode}`} type="range" min={-3} max={3} step={0.05} value={at[mode] ?? 0}
                                    onInput={(e) => { setPlaying(0); void slide(mode, +e.currentTarget.value); }} onChange={(e) => void release(mode, +e.currentTarget.value)} />
                                    <Spread title={`Members along component ${mode}, in standard deviations`} at={at[mode] ?? 0}
                                    values={model.scores.map((row, i) => ({ value: row[mode - 1] / (Math.sqrt(model.eigenvalues[mode - 1]) || 1), name: model.labels[i], group: model.groups?.[i] }))} />
                                </div>
                                <button aria-pressed={playing === mode} onClick={async () => { if (playing === mode) setPlaying(0); else if (await load(mode)) setPlaying(mode); }}>{playing === mode ? 'Stop' : 'Play'}</button>
                            </div>
                        </div>
                    ))}
                    <div class="actions">
                        {shown < model.components && <button onClick={() => setShown(shown + 1)}>Add a component</button>}
                        <button onClick={() => { setPlaying(0); setAt({}); }}>Back to the mean</button>
                    </div>
                    {known ? (
                        <p role="status" class={known.offset > 0.5 ? 'wrong' : 'quiet'}>Computed exactly: {existence(known.offset)} (relative energy {figure(known.energy, 2)}).</p>
                    ) : (
                        <>
                            {doubt.map((d) => <p class={d.off > 0.5 ? 'wrong' : 'quiet'}>Component {d.mode} at {d.k} sd: {existence(d.off)}.</p>)}
                            {active.length > 0 && <p class="quiet">Interpolated{active.length > 1 ? ', with the displacements of several components added' : ''}: let the slider go for the exact shape.</p>}
                        </>
                    )}
                    {error ? <ProblemBox error={error} /> : null}
                </div>
            </div>
        </section>
    );
}

function Components({ model }: { model: api.Model }) {
    const [x, setX] = useState(1);
    const [y, setY] = useState(Math.min(2, model.components));
    const [chosen, setChosen] = useState<number | undefined>();
    const sd = model.eigenvalues.map(Math.sqrt);
    const of = (i: number, k: number) => model.scores[i][k - 1] / (sd[k - 1] || 1);
    const dots = model.scores.map((_, i) => ({ x: of(i, x), y: of(i, y), name: model.labels[i], group: model.groups?.[i] }));
    const select = (value: number, set: (n: number) => void, label: string) => (
        <label>{label} <select value={value} onChange={(e) => set(+e.currentTarget.value)}>
            {model.eigenvalues.map((_, i) => <option value={i + 1}>{i + 1}</option>)}
        </select></label>
    );
    const surfaces: string[] = model.madeFrom?.contents ?? model.madeFrom?.surfaces ?? [];
    return (
        <>
            <Modes model={model} />
            <div class="split">
                <div>
                    <Scatter title="Scores" name="scores" dots={dots} labels={[`component ${x} (sd)`, `component ${y} (sd)`]} chosen={chosen} onChoose={setChosen} />
                    <div class="row no-report">{select(x, setX, 'Across')}{select(y, setY, 'Up')}</div>
                </div>
                {chosen !== undefined && surfaces[chosen]
                    ? <Linked id={surfaces[chosen]} title={`${model.labels[chosen]}${model.groups?.[chosen] ? ` (${model.groups[chosen]})` : ''}`} />
                    : <p class="quiet no-report">Choose a mark to see its shape beside the mean.</p>}
            </div>
            <div class="split">
                <Variance explained={model.explained} cumulative={model.cumulative} />
                <div class="no-report">
                    <h3>Take away</h3>
                    <div class="actions">
                        <button onClick={() => save('scores.csv', csv([['name', 'group', ...model.eigenvalues.map((_, i) => `component ${i + 1}`)], ...model.scores.map((s, i) => [model.labels[i], model.groups?.[i] ?? '', ...s])]), 'text/csv;charset=utf-8')}>Scores as CSV</button>
                        <button onClick={async () => save('model.zip', await (await api.request(`/v1/models/${model.id}/export`)).blob())}>Model as zip</button>
                        <a class="button" href={link('shapes', model.mean.id)}>The mean</a>
                        <a class="button" href={`${link('analyses', 'evaluate-model')}?model=${model.id}`}>Its quality</a>
                        <a class="button" href={`${link('analyses', 'project')}?model=${model.id}`}>A new subject</a>
                        <a class="button" href={`${link('analyses', 'sample')}?model=${model.id}`}>Random shapes</a>
                    </div>
                </div>
            </div>
        </>
    );
}

export function ModelPage({ id }: { id: string }) {
    const model = useLoad<api.Model>((signal) => api.get(`/v1/models/${id}`, signal), [id]);
    return (
        <Shown of={model} page label="the model">{(m) => (
            <Page title={m.name || m.madeFrom?.cohort || 'Model'} actions={<ReportButton title={m.name || 'Model'} id={m.madeFrom?.job} />}>
                <p class="quiet">{m.subjects} shapes, {m.components} components, degree {m.lmax}</p>
                <div class="results"><Components model={m} /></div>
            </Page>
        )}</Shown>
    );
}

// ---- Groups ------------------------------------------------------------------------------------------------------------

function pText(r: any): string {
    const p = r.pValue;
    return `${r.pValueIsFloor ? 'p ≤ ' : 'p = '}${figure(p)}`;
}

/** The geodesic from one mean to the other: both are predictions of a linear model of the labels, so that they are registered to each other. */
function Between({ result }: { result: any }) {
    const [path, setPath] = useState<any>();
    const [busy, setBusy] = useState(false);
    const [error, setError] = useState<unknown>();
    const given = result.inputs;
    const find = async () => {
        setBusy(true);
        setError(undefined);
        try {
            const model = await api.run('regress', {
                cohort: given.cohort.name, formula: 'shape ~ label', at: result.groups.map((label: string) => ({ label })), permutations: 19, bootstraps: 100,
                ...Object.fromEntries(['register', 'commonPose', 'lmax', 'mixedRoutes'].filter((name) => given[name] !== undefined && given[name] !== null).map((name) => [name, given[name]])),
            });
            const [from, to] = model.predictions.map((p: any) => p.surface.id);
            setPath(await api.run('geodesic', { from, to, register: false }));
            refreshJobs();
        } catch (e) {
            setError(e);
        }
        setBusy(false);
    };
    return (
        <section aria-label="Between the means">
            <h2>From {result.groups[0]} to {result.groups[1]}</h2>
            {path ? <Path surfaces={path.surfaces} texts={path.times.map((t: number) => (t === 0 ? `mean of ${result.groups[0]}` : t === 1 ? `mean of ${result.groups[1]}` : `${Math.round(100 * t)} % of the way`))} energies={path.relativeEnergies} />
                : <div class="no-report"><p class="quiet">The geodesic between both means, as an animation. It takes about as long as the comparison did.</p>
                    {mayChange() && <button disabled={busy} onClick={() => void find()}>{busy ? 'Computing the path…' : 'Path between the means'}</button>}</div>}
            {error ? <ProblemBox error={error} /> : null}
        </section>
    );
}

function Groups({ result }: { result: any }) {
    const { shape, error } = useShape(surfacePath(result.surface.id, 32));
    const camera = linked;
    const [threshold, setThreshold] = useState(0.05);
    const [corrected, setCorrected] = useState('significance');
    const [read, setRead] = useState('');
    const [here, setHere] = useState<number | undefined>();
    if (error) return <ProblemBox error={error} />;
    const least = corrected === 'fdr' ? result.leastFdr : result.leastSignificance;
    const p = shape?.fields.find((f) => f.name.toLowerCase() === corrected);
    const effect = shape?.fields.find((f) => /effect/i.test(f.name));
    const keep = p && ((_: number, vertex: number) => p.values[vertex] <= threshold);
    const any = p ? p.low <= threshold : false;
    const sizes: number[] = result.groupSizes?.subjects ?? [];
    return (
        <>
            <p class="big">{pText(result)}{result.pValueInterval && result.pValueInterval[0] !== result.pValueInterval[1] ? ` (${figure(result.pValueInterval[0])} to ${figure(result.pValueInterval[1])})` : ''}
                {' '}<span class="quiet">{result.exact ? 'all relabellings' : `${(result.permutations ?? 0).toLocaleString('en')} permutations`}{result.regressedOut?.length ? `, ${result.regressedOut.join(', ')} regressed out` : ''}</span></p>
            <p>{result.groups?.join(' against ')}{sizes.length ? ` (${sizes.join(' and ')} subjects)` : ''}, distance of the means {figure(result.distance)}.</p>
            <div class="row tools no-report">
                <label>Grey where p exceeds <input type="number" min={0} max={1} step={0.01} value={threshold} onInput={(e) => setThreshold(+e.currentTarget.value)} /></label>
                <label>p <select value={corrected} onChange={(e) => setCorrected(e.currentTarget.value)}>
                    <option value="significance">corrected for all points</option><option value="fdr">false discovery rate</option>
                </select></label>
            </div>
            <p class={any ? '' : 'big'} role="status">{p ? (any ? `Points with p of at most ${figure(threshold)} are in colour.` : `No point is significant: the least p is ${figure(least ?? p.low)}.`) : ''}</p>
            <div class="split">
                {shape && [p, effect].map((field) => field && (() => {
                    const map = { ...mapOf(field), keep };
                    const parts = [{ shape, colours: paintedBy(map) }];
                    return (
                        <figure class="shape">
                            <View parts={parts} camera={camera} onHover={setHere} label={`Map of ${field.name}; ${any ? 'points that are significant are in colour' : 'no point is significant, all is grey'}`} />
                            <ColourBar map={map} threshold={field === p ? threshold : undefined} />
                            <figcaption class="row">{field === p ? 'p at each point' : 'effect'}{field.meaning ? <span class="quiet">{field.meaning}</span> : null}
                                <span class="no-report"><PictureButtons parts={parts} camera={camera} name={`map-${field.name}`} /></span>
                                {field === p && <button class="no-report" onClick={() => {
                                    let best = 0;
                                    for (let i = 1; i < p.values.length; i++) if (p.values[i] < p.values[best]) best = i;
                                    setRead(`Least p ${figure(p.values[best])}${effect ? `, effect there ${figure(effect.values[best])}` : ''}, at vertex ${best}`);
                                }}>Read the least</button>}
                            </figcaption>
                        </figure>
                    );
                })())}
            </div>
            <p class="quiet no-report">{here === undefined || !p ? 'Point at a map to read it.' : `Here p is ${figure(p.values[here])}${effect ? `, the effect ${figure(effect.values[here])}` : ''}, at vertex ${here}.`}</p>
            {read && <p role="status">{read}</p>}
            <div class="actions no-report"><a class="button" href={link('shapes', result.surface.id)}>Maps as files</a></div>
            {result.inputs?.cohort?.name && result.groups?.length === 2 && <Between result={result} />}
        </>
    );
}

// ---- Classification ----------------------------------------------------------------------------------------------------

function Classification({ result, job }: { result: any; job: api.Job }) {
    const names = Object.keys(result.methods);
    const [method, setMethod] = useState(names[0]);
    const [chosen, setChosen] = useState<string | null>(null);
    const m = result.methods[method];
    const cohort = result.inputs?.cohort ?? job.inputs?.cohort ?? {};
    const missed = m.perSubject.filter((s: any) => s.predicted !== s.label);
    const idOf = (subject: string, label: string): string | undefined => {
        // Without subjects in the cohort each member is its own, in their order.
        if (cohort.surfaces?.length === m.perSubject.length) return cohort.surfaces[m.perSubject.findIndex((s: any) => s.subject === subject && s.label === label)];
        const subjects: string[] = cohort.subjects ?? [];
        const i = subjects.findIndex((s, k) => s === subject && (!cohort.labels || cohort.labels[k] === label));
        return cohort.surfaces?.[i];
    };
    return (
        <>
            <div class="split">
                <Intervals chance={Math.max(result.chance, result.majorityRate)} rows={names.map((name) => {
                    const r = result.methods[name];
                    return { name, value: r.accuracy, low: r.confidenceInterval[0], high: r.confidenceInterval[1], p: r.pValue };
                })} />
                <div>
                    <label class="no-report">Method <select value={method} onChange={(e) => setMethod(e.currentTarget.value)}>{names.map((n) => <option>{n}</option>)}</select></label>
                    <Confusion classes={result.classes} counts={m.confusion} title={`${method}: ${m.correct} of ${m.perSubject.length} right`} />
                </div>
            </div>
            <h2>Missed: {missed.length}</h2>
            <div class="split">
                <div class="scroll" tabIndex={0} role="region" aria-label="Members that were missed"><table><thead><tr><th scope="col">Subject</th><th scope="col">Is</th><th scope="col">Taken for</th></tr></thead>
                    <tbody>{missed.map((s: any) => {
                        const id = idOf(s.subject, s.label);
                        return <tr><td>{id ? <button class="plain-button" onClick={() => setChosen(id)}>{s.subject}</button> : s.subject}</td><td>{s.label}</td><td>{s.predicted}</td></tr>;
                    })}</tbody></table></div>
                {chosen && <Linked id={chosen} title="The member that was missed" />}
            </div>
        </>
    );
}

// ---- Distances ---------------------------------------------------------------------------------------------------------

function Distances({ result, job }: { result: any; job: api.Job }) {
    const [chosen, setChosen] = useState<number | undefined>();
    const { points, share } = useMemo(() => scaling(result.matrix), [result]);
    const ids: string[] = result.inputs?.cohort?.surfaces ?? result.inputs?.surfaces ?? job.inputs?.surfaces ?? [];
    const near = chosen === undefined ? [] : result.matrix[chosen].map((d: number, i: number) => ({ d, i })).filter((e: any) => e.i !== chosen).sort((a: any, b: any) => a.d - b.d).slice(0, 5);
    return (
        <>
            <div class="split">
                <HeatMap labels={result.labels} matrix={result.matrix} chosen={chosen} onChoose={setChosen} />
                <Scatter equal title={`Classical scaling: ${Math.round(100 * share)} % in two dimensions`} name="scaling" labels={['first', 'second']} chosen={chosen} onChoose={setChosen}
                    dots={points.map(([x, y], i) => ({ x, y, name: result.labels[i], group: result.groups?.[i] }))} />
            </div>
            {chosen !== undefined && (
                <div class="split">
                    {ids[chosen] && <Linked id={ids[chosen]} title={result.labels[chosen]} />}
                    <div><h3>Nearest to {result.labels[chosen]}</h3>
                        <ol>{near.map((e: any) => <li><button class="plain-button" onClick={() => setChosen(e.i)}>{result.labels[e.i]}</button> {figure(e.d)}</li>)}</ol></div>
                </div>
            )}
        </>
    );
}

// ---- Paths ---------------------------------------------------------------------------------------------------------------

function Path({ surfaces, texts, energies }: { surfaces: api.Surface[]; texts: string[]; energies?: (number | null)[] }) {
    const loaded = useLoad(() => Promise.all(surfaces.map((s) => shapeAt(surfacePath(s.id)))), [surfaces]);
    const [at, setAt] = useState(0);
    const [playing, setPlaying] = useState(false);
    const [version, setVersion] = useState(0);
    const moving = useMemo(() => loaded.value && { ...loaded.value[0], positions: loaded.value[0].positions.slice(), normals: loaded.value[0].normals.slice(), fields: [] as never[] }, [loaded.value]);
    const last = surfaces.length - 1;
    const same = loaded.value?.every((s) => s.positions.length === loaded.value![0].positions.length);
    useEffect(() => {
        if (!moving || !loaded.value || !same) return;
        const i = Math.min(last, Math.floor(at));
        const t = at - i;
        const a = loaded.value[i].positions;
        const b = loaded.value[Math.min(last, i + 1)].positions;
        for (let k = 0; k < a.length; k++) moving.positions[k] = a[k] + t * (b[k] - a[k]);
        normalsOf(moving);
        moved(moving);
        setVersion((v) => v + 1);
    }, [at, moving]);
    useEffect(() => {
        if (!playing) return;
        let frame = 0;
        const start = performance.now();
        const step = (now: number) => {
            const phase = ((now - start) / 2500) % 2;
            setAt(last * (phase < 1 ? phase : 2 - phase));
            frame = requestAnimationFrame(step);
        };
        frame = requestAnimationFrame(step);
        return () => cancelAnimationFrame(frame);
    }, [playing]);
    const here = Math.round(at);
    return (
        <Shown of={loaded} label="shapes">{() => (
            <>
                <figure class="shape tall">
                    {moving && <View parts={[{ shape: moving }]} camera={linked} version={version} label={`Shape ${texts[here]}`} />}
                    <figcaption class="row">
                        <span>{texts[here]}{energies?.[here] !== undefined ? <span class="quiet"> relative energy {figure(energies[here], 2)}</span> : null}</span>
                        {moving && <span class="no-report"><PictureButtons parts={[{ shape: moving }]} camera={linked} name="path" /></span>}
                    </figcaption>
                </figure>
                <div class="row no-report">
                    <button onClick={() => setPlaying(!playing)} aria-pressed={playing}>{playing ? 'Stop' : 'Play'}</button>
                    <input class="grow" type="range" min={0} max={last} step={0.01} value={at} aria-label="Where along the path" onInput={(e) => { setPlaying(false); setAt(+e.currentTarget.value); }} />
                </div>
                <div class="gallery">{surfaces.map((s, i) => <Linked id={s.id} title={texts[i]} resolution={24} />)}</div>
            </>
        )}</Shown>
    );
}

// ---- Linear models -----------------------------------------------------------------------------------------------------

const pOf = (test: any): string => `${test.pValueIsFloor ? '≤ ' : ''}${figure(test.pValue)}`;
const shareOf = (test: any): string => `${figure(test.r2)} (${test.r2Interval?.map((v: number) => figure(v)).join(' to ') ?? '–'})`;
const pointOf = (at: Record<string, unknown>): string => Object.entries(at).map(([name, v]) => `${name} ${typeof v === 'number' ? figure(v) : v}`).join(', ');

/** Predictions in the order of the covariate that differs among them, if it is one number. */
export function alongOne(predictions: any[]): any[] {
    const names = Object.keys(predictions[0]?.at ?? {}).filter((name) => new Set(predictions.map((p) => p.at[name])).size > 1);
    const numeric = names.length === 1 && predictions.every((p) => typeof p.at[names[0]] === 'number');
    return numeric ? [...predictions].sort((a, b) => a.at[names[0]] - b.at[names[0]]) : predictions;
}

function Regression({ result }: { result: any }) {
    const [chosen, setChosen] = useState(Math.min(1, result.coefficients.length - 1));
    const sorted = useMemo(() => alongOne(result.predictions ?? []), [result]);
    const surfaces = useMemo(() => sorted.map((p: any) => p.surface), [sorted]);
    const rows = [...result.terms.map((t: any) => [t.name, t]), ['all terms', result.model]].filter(([, t]) => t) as [string, any][];
    const coefficient = result.coefficients[chosen];
    return (
        <>
            <p class="big"><code>{result.formula}</code></p>
            <p class="quiet">{plural(result.subjects, 'subject')}, {result.exact ? 'all relabellings' : `${(result.permutations ?? 0).toLocaleString('en')} permutations`}, {result.bootstraps} bootstrap samples.</p>
            <DataTable rows={[['term', 'p', 'share of the variance (95 %)', 'least p on the map', 'F', 'degrees of freedom'],
                ...rows.map(([name, t]) => [name, pOf(t), shareOf(t), figure(t.leastSignificance), figure(t.f), `${t.degreesOfFreedom}, ${t.residualDegreesOfFreedom}`])]} />
            {result.pairwise?.length > 0 && <><h3>Pairs of levels</h3><DataTable rows={[['term', 'levels', 'p', 'corrected p'], ...result.pairwise.map((p: any) => [p.term, p.levels?.join(' and '), pOf(p), figure(p.correctedP)])]} /></>}
            {sorted.length > 0 && (
                <><h2>Predicted shapes</h2>
                    <Path surfaces={surfaces} texts={sorted.map((p: any) => pointOf(p.at))} energies={sorted.map((p: any) => p.relativeEnergy)} /></>
            )}
            <h2>What a unit moves</h2>
            <label class="no-report">Coefficient <select value={chosen} onChange={(e) => setChosen(+e.currentTarget.value)}>
                {result.coefficients.map((c: any, i: number) => <option value={i}>{c.name}</option>)}
            </select></label>
            {coefficient?.surface ? <Shape key={coefficient.surface.id} src={surfacePath(coefficient.surface.id, 32)} label={`Mean with the maps of ${coefficient.name}`} name={coefficient.name} first="normalEffect" />
                : <p class="quiet">This coefficient has no maps.</p>}
        </>
    );
}

// ---- Classifiers -------------------------------------------------------------------------------------------------------

const doubtful = (typicality: any): string => Object.entries<any>(typicality ?? {}).filter(([, t]) => t && t.value > t.limit).map(([name]) => api.words(name).toLowerCase()).join(', ');

function Trained({ result }: { result: any }) {
    const missed = result.perSubject.filter((s: any) => s.predicted !== s.label);
    return (
        <>
            <p class="big">{result.validation.correct} of {plural(result.validation.members, 'member')} right, each without its subject.</p>
            <Findings result={result} />
            <h2>Missed: {missed.length}</h2>
            <DataTable rows={[['subject', 'is', 'taken for', ...result.classes.map((c: string) => `probability of ${c}`)],
                ...missed.map((s: any) => [s.subject, s.label, s.predicted, ...result.classes.map((c: string) => s.probabilities[c])])]} />
            <div class="actions no-report"><a class="button" href={`${link('analyses', 'predict')}?model=${result.model.id}`}>A new subject</a></div>
        </>
    );
}

function Predicted({ result }: { result: any }) {
    const [chosen, setChosen] = useState(0);
    const one = result.predictions[chosen];
    const far = doubtful(one.typicality);
    return (
        <>
            <div class="split">
                <div class="scroll" tabIndex={0} role="region" aria-label="Predictions"><table>
                    <thead><tr><th scope="col">Subject</th><th scope="col">Label</th>{result.classes.map((c: string) => <th scope="col">{c}</th>)}<th scope="col">Unlike all by</th></tr></thead>
                    <tbody>{result.predictions.map((p: any, i: number) => (
                        <tr><td><button class="plain-button" aria-pressed={i === chosen} onClick={() => setChosen(i)}>{p.subject}</button></td><td>{p.label}</td>
                            {result.classes.map((c: string) => <td>{figure(100 * p.probabilities[c])} %</td>)}<td>{doubtful(p.typicality) || '–'}</td></tr>
                    ))}</tbody>
                </table></div>
                <div>
                    <Linked id={one.surface} title={`${one.subject}: ${one.label}`} />
                    {far ? <p class="wrong">It is unlike the members of every class ({far}): its label and its probabilities say nothing.</p>
                        : <p>Probability of {one.label}: {figure(100 * one.probabilities[one.label])} %, against {figure(100 * result.priors[one.label])} % before it was seen.</p>}
                </div>
            </div>
            <Findings result={result} />
        </>
    );
}

// ---- Beside the norm ---------------------------------------------------------------------------------------------------

function Scored({ result }: { result: any }) {
    const { zMap, calibration } = result;
    return (
        <>
            <p class="big">Percentile {figure(result.percentile)} <span class="quiet">({result.percentileInterval?.map((v: number) => figure(v)).join(' to ')}, beside {plural(result.subjects, 'subject')}; {plural(result.asOdd, 'of them is', 'of them are')} as odd)</span></p>
            <p>p = {figure(result.pValue)}. Mahalanobis distance {figure(result.mahalanobis)} in {plural(result.components, 'component')}, {figure(result.residual)} from their space.
                {result.at ? ` Expected for ${pointOf(result.at)}.` : ''}{result.trainingSubject ? ' It is a member of the model, and was left out.' : ''}</p>
            {zMap ? <Shape src={surfacePath(zMap.id, 32)} label="The surface with its z map" name="z-map" first="zScore" /> : <p class="quiet">No map was asked for.</p>}
            {calibration && <p class="quiet">Percentiles of {plural(calibration.subjects, 'subject')} that were left out differ from uniform ones by {figure(calibration.overall?.distance)} (p = {figure(calibration.overall?.pValue)}).</p>}
            <Findings result={result} />
        </>
    );
}

// ---- Any result ----------------------------------------------------------------------------------------------------------

const isRecord = (v: any, kind: string): boolean => !!v && typeof v === 'object' && typeof v.id === 'string' && v.id.startsWith(kind);

function AnyResult({ result }: { result: any }) {
    const plain: [string, any][] = [];
    const shapes: { name: string; id: string }[] = [];
    const tables: [string, any[]][] = [];
    for (const [name, value] of Object.entries<any>(result)) {
        if (['inputs', 'warnings', 'numericBuild', 'history', 'registration'].includes(name)) continue;
        if (isRecord(value, 'surf-') || isRecord(value, 'mesh-')) shapes.push({ name: value.name || name, id: value.id });
        else if (Array.isArray(value) && value.length && isRecord(value[0], 'surf-')) value.forEach((v: any) => shapes.push({ name: v.name || name, id: v.id }));
        else if (Array.isArray(value) && value.length && value[0] && typeof value[0] === 'object' && !Array.isArray(value[0])) tables.push([name, value]);
        else if (value !== null && value !== undefined) plain.push([name, value]);
    }
    const text = (v: any): string => (typeof v === 'number' ? figure(v, 5) : typeof v === 'string' ? v : JSON.stringify(v).slice(0, 300));
    return (
        <>
            <div class="gallery">{shapes.slice(0, 40).map((s) => s.id.startsWith('mesh-')
                ? <a href={link('meshes', s.id)}>{s.name}</a>
                : <div><Linked id={s.id} title={s.name} /><a class="no-report" href={link('shapes', s.id)}>Open, download</a></div>)}</div>
            <dl class="pairs">{plain.map(([name, value]) => <><dt>{name}</dt><dd>{text(value)}</dd></>)}</dl>
            {tables.map(([name, rows]) => {
                const columns = Object.keys(rows[0]);
                return <><h3>{name}</h3><DataTable rows={[columns, ...rows.map((r) => columns.map((c) => (typeof r[c] === 'number' ? r[c] : text(r[c] ?? '–'))))]} /></>;
            })}
        </>
    );
}

function Written({ result, job }: { result: any; job: api.Job }) {
    const title = result.inputs?.title ?? job.name;
    return (
        <>
            <p class="big">{title}</p>
            <p>{plural(result.sections.length, 'section')}, {plural(result.shapes, 'shape')}, {size(result.bytes)}.</p>
            <ul>{result.sections.map((s: any) => <li><a href={link('jobs', s.job)}>{s.name || s.process}</a></li>)}</ul>
            <button class="main" onClick={() => save(`${title.replace(/[^A-Za-z0-9._-]+/g, '-')}.html`, result.html, 'text/html;charset=utf-8')}>Save the report</button>
        </>
    );
}

function Quality({ result }: { result: any }) {
    const curve = (name: string, title: string) => {
        const points = (result[name] ?? []).filter((p: any) => p.value !== null).map((p: any) => ({ x: p.components, y: p.value, error: p.standardError }));
        return points.length > 1 ? <Curve key={name} title={title} name={name} points={points} labels={['components', name]} /> : null;
    };
    return <div class="split">{curve('generalisation', 'Generalisation: how far left-out shapes stay')}{curve('specificity', 'Specificity: how far random shapes are from real ones')}{curve('compactness', 'Compactness: variance so far')}</div>;
}

/** A new subject among those of the model. */
function Projection({ result, job }: { result: any; job: api.Job }) {
    const id = result.inputs?.model?.id ?? result.inputs?.model ?? job.inputs?.model;
    const model = useLoad<api.Model>((signal) => api.get(`/v1/models/${id}`, signal), [id]);
    const surface = result.inputs?.surface?.id ?? result.inputs?.surface ?? job.inputs?.surface;
    return (
        <Shown of={model} label="the model">{(m) => {
            const sd = (k: number) => Math.sqrt(m.eigenvalues[k]) || 1;
            const second = Math.min(1, m.components - 1);
            const dots = m.scores.map((s, i) => ({ x: s[0] / sd(0), y: s[second] / sd(second), name: m.labels[i], group: m.groups?.[i] }));
            dots.push({ x: result.scores[0] / sd(0), y: result.scores[second] / sd(second), name: 'the new subject', group: 'new' });
            return (
                <div class="split">
                    <Scatter title="The new subject among the others" name="projection" dots={dots} chosen={dots.length - 1} onChoose={() => {}} labels={['component 1 (sd)', `component ${second + 1} (sd)`]} />
                    <div>
                        {typeof surface === 'string' && <Linked id={surface} title="The new subject" />}
                        <dl class="pairs">
                            {!result.typicality && <><dt>Residual</dt><dd>{figure(result.residual)}</dd><dt>Distance from the mean</dt><dd>{figure(result.distance)}</dd>
                                <dt>Mahalanobis</dt><dd>{figure(result.mahalanobis)}</dd></>}
                            {Object.entries<any>(result.typicality ?? {}).map(([name, t]) => t && typeof t === 'object' && <><dt>{api.words(name)}</dt><dd>{figure(t.value)} (percentile {figure(t.percentile)}, doubtful above {figure(t.limit)})</dd></>)}
                        </dl>
                    </div>
                </div>
            );
        }}</Shown>
    );
}

function ReportButton({ title, job, id }: { title: string; job?: api.Job; id?: string }) {
    const [busy, setBusy] = useState(false);
    const [error, setError] = useState<unknown>();
    return (
        <>
            <button class="no-report" disabled={busy} onClick={async () => {
                setBusy(true);
                setError(undefined);
                await makeReport(title, document.querySelector<HTMLElement>('.results')!, job, id).catch(setError);
                setBusy(false);
            }}>{busy ? 'Writing the report…' : 'Report as one page'}</button>
            {error ? <ProblemBox error={error} /> : null}
        </>
    );
}

export function Results({ job }: { job: api.Job }) {
    const loaded = useLoad<any>(() => api.results(job.id), [job.id]);
    return (
        <Shown of={loaded} label="results">{(result) => {
            const process = job.process;
            let view;
            if (process === 'pca') view = <Components model={result.model} />;
            else if (process === 'compare-groups') view = <Groups result={result} />;
            else if (process === 'classify') view = <Classification result={result} job={job} />;
            else if (process === 'distances') view = <Distances result={result} job={job} />;
            else if (process === 'regress') view = <Regression result={result} />;
            else if (process === 'train') view = <Trained result={result} />;
            else if (process === 'predict') view = <Predicted result={result} />;
            else if (process === 'score') view = <Scored result={result} />;
            else if (process === 'report') view = <Written result={result} job={job} />;
            else if (process === 'project') view = <Projection result={result} job={job} />;
            else if (process === 'evaluate-model') view = <><Quality result={result} /><AnyResult result={{ members: result.members, subjects: result.subjects }} /></>;
            else if (process === 'geodesic') view = <><Path surfaces={result.surfaces} texts={result.times.map((t: number) => `t = ${figure(t)}`)} energies={result.relativeEnergies} /><AnyResult result={{ distance: result.distance, length: result.length }} /></>;
            else if (process === 'modes') view = <Path surfaces={result.surfaces} texts={result.coefficients.map((c: number) => `${figure(c)} sd`)} energies={result.relativeEnergy} />;
            else if (process === 'shoot') view = <Path surfaces={result.surfaces} texts={result.surfaces.map((s: api.Surface, i: number) => s.name || `${i + 1}`)} energies={result.relativeEnergies} />;
            else view = <AnyResult result={result} />;
            return (
                <>
                    <div class="results"><Warnings list={result.warnings} />{view}</div>
                    <div class="actions">
                        {process !== 'report' && <ReportButton title={job.name || job.process} job={job} />}
                        <button onClick={() => save(`${job.process}.json`, JSON.stringify(result, null, 2), 'application/json')}>Results as JSON</button>
                        {process === 'distances' && <button onClick={async () => save('distances.csv', await (await api.request(`/v1/jobs/${job.id}/results?format=csv`)).blob())}>Matrix as CSV</button>}
                    </div>
                </>
            );
        }}</Shown>
    );
}
