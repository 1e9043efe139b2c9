// The mean of a group and its components: sliders that move the shape, the scores of the members, the variance, and what
// can be taken away.
import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import * as api from './api';
import { Scatter, Spread, Variance } from './charts';
import { normalsOf } from './geometry';
import type { Surface3 } from './glb';
import { t } from './i18n';
import { aPlace, aSwitch, maybe, sliders, useKept } from './kept';
import { ColourBar, paintedBy } from './maps';
import type { Map3 } from './maps';
import { LIVE_MAX, existence, shapeFile, shapeOf } from './model_shape';
import type { Point } from './model_shape';
import { MontageButton } from './montage';
import { Linked } from './paths';
import { came, link } from './router';
import { Downloads, PictureButtons, View, linked, surfacePath, useShape } from './shape';
import { moved } from './stage';
import { mayChange, useValue } from './state';
import { FORMATS, ProblemBox, csv, errorOf, figure, save } from './ui';

/** Positions at each keyframe, and how far off each is: the nearest shape against the point asked for. */
interface Frames { positions: Float32Array[]; offsets: number[] }
interface Exact extends Point { at: Record<number, number> }

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

/** Of points that correspond, the part of the way from a shape that is along its normals. */
function along(positions: Float32Array, from: Surface3): Float32Array {
    return Float32Array.from({ length: positions.length / 3 }, (_, v) => {
        let sum = 0;
        for (let k = 3 * v; k < 3 * v + 3; k++) sum += (positions[k] - from.positions[k]) * from.normals[k];
        return sum;
    });
}

const STEPS = [-2, -1, 0, 1, 2]; // standard deviations of the shapes in a picture of components

function Modes({ model }: { model: api.Model }) {
    const mean = useShape(surfacePath(model.mean.id));
    const frames = useRef(new Map<number, Frames>());
    const [loading, setLoading] = useState<number | null>(null);
    const [at, setAt] = useKept<Record<number, number>>('sd', {}, sliders(model.components, 3));
    const [shown, setShown] = useKept('sliders', Math.min(3, model.components), aPlace(model.components, 1));
    const [version, setVersion] = useState(0);
    const [error, setError] = useState<unknown>();
    const [playing, setPlaying] = useState(0);
    const [exact, setExact] = useState<Exact | null>(null);
    const [mapped, setMapped] = useKept('far', false, aSwitch);
    const asked = useRef<AbortController | null>(null);
    const rounds = useValue(came);
    const live = model.lmax <= LIVE_MAX;
    const active = Object.entries(at).filter(([, v]) => v !== 0);
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
    // Those of a link, which were moved before the page was there.
    useEffect(() => {
        if (live && mean.shape && !playing) for (const [mode] of active) void load(+mode);
    }, [at, mean.shape]);
    useEffect(() => {
        if (live && mean.shape && active.length) void settle(at);
    }, [mean.shape, rounds]);
    /** A slider was let go: the shape of all coefficients together, without interpolation. */
    const release = (mode: number, value: number) => {
        const where = { ...at, [mode]: value };
        setAt(where);
        return settle(where);
    };
    const settle = async (where: Record<number, number>) => {
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
    /** Shapes along each component that is shown, the mean in their middle. */
    const rows = async () => {
        const made = [];
        for (let mode = 1; mode <= shown; mode++) {
            if (!(await load(mode))) throw new Error(t`A shape of the picture could not be computed.`);
            const { positions } = frames.current.get(mode)!;
            const shapes = STEPS.map((c) => ({ ...mean.shape!, positions: positions[c + 3], normals: new Float32Array(mean.shape!.normals.length), fields: [] }));
            shapes.forEach(normalsOf);
            made.push({ text: t`Component ${mode}\n${figure(100 * (model.explained[mode - 1] ?? 0))} %`, shapes });
        }
        return made;
    };
    const map = useMemo((): Map3 | undefined => {
        if (!mapped || !moving || !mean.shape) return undefined;
        const values = along(moving.positions, mean.shape);
        // The range is that of what was loaded: colours keep their meaning while a slider moves.
        const far = active.flatMap(([mode]) => [0, 6].map((k) => frames.current.get(+mode)?.positions[k]).filter((p): p is Float32Array => !!p));
        const most = [values, ...far.map((p) => along(p, mean.shape!))].reduce((high, list) => list.reduce((a, b) => Math.max(a, Math.abs(b)), high), 0) || 1;
        const field = { name: 'displacement', unit: 'length', meaning: '', values, low: -most, high: most };
        return { field, scale: 'signed', low: -most, high: most, title: t`outwards from the mean, in units of the shape` };
    }, [mapped, version, loading]);
    const parts = moving ? [{ shape: moving, colours: map && paintedBy(map) }] : [];
    const coefficients = Array.from({ length: Math.max(0, ...Object.keys(at).map(Number)) }, (_, i) => at[i + 1] ?? 0);
    const known = exact?.at === at ? exact : null;
    const doubt = active.map(([mode, v]) => {
        const k = Math.round(v) || Math.sign(v);
        const off = frames.current.get(+mode)?.offsets[k + 3];
        return off === undefined ? null : { mode, k, off };
    }).filter((d): d is { mode: string; k: number; off: number } => d !== null);
    return (
        <section aria-label={t`Components`}>
            <h2>{t`Mean and components`}</h2>
            <div class="split">
                <figure class="shape">
                    {moving ? <View parts={parts} camera={linked} version={version} label={active.length ? t`Shape at ${active.map(([m, v]) => t`component ${m}: ${figure(v)} standard deviations`).join(', ')}` : t`Mean shape`} />
                        : <div class="view" aria-busy="true" />}
                    <figcaption class="row">
                        {active.length ? active.map(([m, v]) => t`component ${m}: ${v > 0 ? '+' : ''}${figure(v)} sd`).join(', ') : t`mean`}
                        {moving && <span class="no-report"><PictureButtons parts={parts} camera={linked} name="mode" map={map} /></span>}
                        {live && <span class="no-report"><Downloads name={active.map(([m, v]) => `component-${m}_${figure(v)}sd`).join('_') || 'mean'} files={FORMATS.map((f) => [f, shapeFile(model.id, coefficients, f)])} /></span>}
                        {live && moving && <label class="check no-report"><input type="checkbox" checked={mapped} onChange={(e) => setMapped(e.currentTarget.checked)} /> {t`how far from the mean`}</label>}
                    </figcaption>
                    {map && <ColourBar map={map} />}
                </figure>
                {!live ? (
                    <div class="no-report">
                        <p>{t`Shapes of models above degree ${LIVE_MAX} take a job each.`}</p>
                        {mayChange() && <a class="button main" href={`${link('analyses', 'modes')}?model=${model.id}`}>{t`Shapes along a component`}</a>}
                    </div>
                ) : <div class="no-report">
                    {Array.from({ length: shown }, (_, i) => i + 1).map((mode) => (
                        <div class="field" key={mode}>
                            <label for={`mode-${mode}`}>{t`Component ${mode}`} <span class="quiet">{t`${Math.round(100 * (model.explained[mode - 1] ?? 0))} %${errorOf(model.explainedIntervals?.[mode - 1]?.map((v: number) => Math.round(100 * v)))} of the variance, now ${figure(at[mode] ?? 0)} sd${loading === mode ? t`, loading…` : ''}`}</span></label>
                            <div class="row">
                                <div class="grow track">
                                    <input id={`mode-${mode}`} type="range" min={-3} max={3} step={0.05} value={at[mode] ?? 0}
                                    onInput={(e) => { setPlaying(0); void slide(mode, +e.currentTarget.value); }} onChange={(e) => void release(mode, +e.currentTarget.value)} />
                                    <Spread title={t`Members along component ${mode}, in standard deviations`} at={at[mode] ?? 0}
                                    values={model.scores.map((row, i) => ({ value: row[mode - 1] / (Math.sqrt(model.eigenvalues[mode - 1]) || 1), name: model.labels[i], group: model.groups?.[i] }))} />
                                </div>
                                <button aria-pressed={playing === mode} onClick={async () => { if (playing === mode) setPlaying(0); else if (await load(mode)) setPlaying(mode); }}>{playing === mode ? t`Stop` : t`Play`}</button>
                            </div>
                        </div>
                    ))}
                    <div class="actions">
                        {shown < model.components && <button onClick={() => setShown(shown + 1)}>{t`Add a component`}</button>}
                        <button onClick={() => { setPlaying(0); setAt({}); }}>{t`Back to the mean`}</button>
                        {mean.shape && <MontageButton title={t`All in one picture`} name="components" rows={rows} columns={STEPS.map((c) => (c === 0 ? t`mean` : t`${c > 0 ? '+' : '−'}${Math.abs(c)} sd`))} camera={linked} />}
                    </div>
                    {known ? (
                        <p role="status" class={known.offset > 0.5 ? 'wrong' : 'quiet'}>{t`Computed exactly: ${existence(known.offset)} (relative energy ${figure(known.energy, 2)}).`}</p>
                    ) : (
                        <>
                            {doubt.map((d) => <p class={d.off > 0.5 ? 'wrong' : 'quiet'}>{t`Component ${d.mode} at ${d.k} sd: ${existence(d.off)}.`}</p>)}
                            {active.length > 0 && <p class="quiet">{t`Interpolated${active.length > 1 ? t`, with the displacements of several components added` : ''}: let the slider go for the exact shape.`}</p>}
                        </>
                    )}
                    {error ? <ProblemBox error={error} /> : null}
                </div>}
            </div>
        </section>
    );
}

export function Components({ model }: { model: api.Model }) {
    const [x, setX] = useKept('across', 1, aPlace(model.components, 1));
    const [y, setY] = useKept('up', Math.min(2, model.components), aPlace(model.components, 1));
    const [chosen, setChosen] = useKept('chosen', undefined, maybe(aPlace(model.scores.length)));
    const sd = model.eigenvalues.map(Math.sqrt);
    const of = (i: number, k: number) => model.scores[i][k - 1] / (sd[k - 1] || 1);
    const dots = model.scores.map((_, i) => ({ x: of(i, x), y: of(i, y), name: model.labels[i], group: model.groups?.[i] }));
    const select = (value: number, set: (n: number) => void, label: string) => (
        <label>{label} <select value={value} onChange={(e) => set(+e.currentTarget.value)}>
            {model.eigenvalues.map((_, i) => <option value={i + 1}>{i + 1}</option>)}
        </select></label>
    );
    const surfaces = model.madeFrom.surfaces ?? []; // the members as they were given: encodings of meshes are not kept
    return (
        <>
            <Modes model={model} />
            <div class="split">
                <div>
                    <Scatter title={t`Scores`} name="scores" dots={dots} labels={[t`component ${x} (sd)`, t`component ${y} (sd)`]} chosen={chosen} onChoose={setChosen} />
                    <div class="row no-report">{select(x, setX, t`Across`)}{select(y, setY, t`Up`)}</div>
                </div>
                {chosen !== undefined && surfaces[chosen]
                    ? <Linked id={surfaces[chosen]} title={`${model.labels[chosen]}${model.groups?.[chosen] ? ` (${model.groups[chosen]})` : ''}${model.madeFrom?.mirrored?.[chosen] ? t`, analysed as its mirror image` : ''}`} />
                    : <p class="quiet no-report">{t`Choose a mark to see its shape beside the mean.`}</p>}
            </div>
            <div class="split">
                <Variance explained={model.explained} cumulative={model.cumulative} />
                <div class="no-report">
                    <h3>{t`Take away`}</h3>
                    <div class="actions">
                        <button onClick={() => save('scores.csv', csv([['name', 'group', ...model.eigenvalues.map((_, i) => t`component ${i + 1}`)], ...model.scores.map((s, i) => [model.labels[i], model.groups?.[i] ?? '', ...s])]), 'text/csv;charset=utf-8')}>{t`Scores as CSV`}</button>
                        <button onClick={async () => save('model.zip', await (await api.request(`/v1/models/${model.id}/export`)).blob())}>{t`Model as zip`}</button>
                        <a class="button" href={link('shapes', model.mean.id)}>{t`The mean`}</a>
                        {mayChange() && <>
                            <a class="button" href={`${link('analyses', 'evaluate-model')}?model=${model.id}`}>{t`Its quality`}</a>
                            <a class="button" href={`${link('analyses', 'project')}?model=${model.id}`}>{t`A new subject`}</a>
                            <a class="button" href={`${link('analyses', 'sample')}?model=${model.id}`}>{t`Random shapes`}</a>
                        </>}
                    </div>
                </div>
            </div>
        </>
    );
}
