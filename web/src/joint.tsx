// Several structures of each subject together: all in one view, moved along joint components.
import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import * as api from './api';
import { DataTable, Spread } from './charts';
import { JointCharts } from './charts_joint';
import { GROUPS } from './colours';
import { boundsOf, copyOf, normalsOf } from './geometry';
import type { Surface3 } from './glb';
import { t } from './i18n';
import { aPlace, maybe, sliders, useKept } from './kept';
import { Linked } from './paths';
import { came, link } from './router';
import { LIVE_MAX, existence, shapeOf } from './model_shape';
import type { Point } from './model_shape';
import { middlesOf, movePart, placesOf, sizesOf } from './series';
import type { Frames } from './series';
import { PictureButtons, View, linked, shapeAt, surfacePath } from './shape';
import { mayChange, useValue } from './state';
import { moved } from './stage';
import { ProblemBox, Shown, figure, plural, useLoad } from './ui';

/** How far the vertex of the shapes is that is farthest from a point. */
function farFrom(centre: number[], shapes: Surface3[]): number {
    let most = 0;
    for (const { positions: p } of shapes)
        for (let i = 0; i < p.length; i += 3) most = Math.max(most, Math.hypot(p[i] - centre[0], p[i + 1] - centre[1], p[i + 2] - centre[2]));
    return most;
}

const radiusOf = (shape: Surface3): number => boundsOf([shape]).radius;

async function load(result: any, places: Map<number, number[]>): Promise<Frames[]> {
    return Promise.all(result.parts.map(async (part: any): Promise<Frames> => {
        const mean = await shapeAt(surfacePath(part.mean.id));
        const along = new Map<number, Surface3[]>();
        for (const [component, list] of places) {
            along.set(component, await Promise.all(list.map((sd) => {
                const mode = result.modes.find((m: any) => m.component === component && m.part === part.name && m.deviations === sd);
                return mode ? shapeAt(surfacePath(mode.surface.id)) : mean;
            })));
        }
        return { mean, along };
    }));
}

/** Of a model that is kept: shapes of any component are computed when it is first moved, and that of all when it is let go. */
interface Live { load: (component: number) => Promise<void>; exact: (coefficients: number[], signal: AbortSignal) => Promise<Point[]> }

const PLACES = [-3, -2, -1, 0, 1, 2, 3];

function liveOf(id: string, names: string[], frames: Frames[], places: Map<number, number[]>): Live {
    const coming = new Map<number, Promise<void>>();
    const load = async (component: number) => {
        const none = new Array(component - 1).fill(0);
        places.set(component, PLACES);
        for (const [p, name] of names.entries()) {
            const { mean } = frames[p];
            const along: Surface3[] = [];
            // Three at a time: a browser opens six connections to a host, and others want some.
            for (const some of [[-3, -2, -1], [1, 2, 3]])
                for (const [sd, found] of await Promise.all(some.map(async (sd) => [sd, await shapeOf(id, [...none, sd], undefined, name)] as const)))
                    along[sd + 3] = { ...mean, positions: found.positions };
            along[3] = mean;
            frames[p].along.set(component, along);
        }
    };
    return {
        load: (component) => {
            if (!coming.has(component)) {
                const one = load(component);
                one.catch(() => coming.delete(component));
                coming.set(component, one);
            }
            return coming.get(component)!;
        },
        exact: (coefficients, signal) => Promise.all(names.map((name) => shapeOf(id, coefficients, signal, name))),
    };
}

function Together({ result, frames, places, live }: { result: any; frames: Frames[]; places: Map<number, number[]>; live?: Live }) {
    const [at, setAt] = useKept<Record<number, number>>('sd', {}, sliders(result.eigenvalues.length, 3));
    const [playing, setPlaying] = useState(0);
    const [version, setVersion] = useState(0);
    const [loading, setLoading] = useState(0);
    const [exact, setExact] = useState<{ at: Record<number, number>; points: Point[] } | null>(null);
    const [error, setError] = useState<unknown>();
    const [count, setCount] = useKept('sliders', live ? Math.min(3, result.eigenvalues.length) : 0, aPlace(result.eigenvalues.length, 1));
    const asked = useRef<AbortController | null>(null);
    const rounds = useValue(came);
    const moving = useMemo(() => frames.map((f) => ({ ...copyOf(f.mean), fields: [] })), [frames]);
    const radii = useMemo(() => frames.map((f) => Math.max(radiusOf(f.mean), ...[...f.along.values()].flat().map(radiusOf))), [frames]);
    const sizes = useMemo(() => sizesOf(result), [result]);
    const known = exact?.at === at ? exact : null;
    const place = (where: Record<number, number>, points?: Point[]) => {
        const middles = middlesOf(result, radii, where);
        moving.forEach((shape, p) => {
            const mean = points ? { ...frames[p].mean, positions: points[p].positions } : frames[p].mean;
            movePart(shape, { mean, along: frames[p].along }, places, points ? {} : where, sizes[p], middles[p]);
            normalsOf(shape);
            moved(shape);
        });
        if (sight.current) sight.current.radius = Math.max(sight.current.radius, 1.1 * farFrom(sight.current.centre, moving));
        setVersion((v) => v + 1);
    };
    // What is seen grows with the structures, so that none leaves it.
    const sight = useRef<ReturnType<typeof boundsOf> | null>(null);
    useMemo(() => {
        sight.current = null;
        place({});
        sight.current = boundsOf(moving);
        sight.current.radius *= 1.1;
    }, [moving]);
    const look = { ...sight.current! };
    useEffect(() => place(at, known?.points), [at, moving, exact, loading]);
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
    const load = async (component: number): Promise<void> => {
        if (!live) return;
        if (frames.some((f) => !f.along.has(component))) setLoading(component);
        await live.load(component).catch(setError);
        setLoading(0);
    };
    /** A slider was let go: the shapes of all components together, without interpolation. */
    const release = (component: number, value: number) => {
        const where = { ...at, [component]: value };
        setAt(where);
        return settle(where);
    };
    const settle = async (where: Record<number, number>) => {
        asked.current?.abort();
        const coefficients = Array.from({ length: Math.max(...Object.keys(where).map(Number)) }, (_, i) => where[i + 1] ?? 0);
        if (!live || coefficients.every((c) => c === 0)) return;
        asked.current = new AbortController();
        try {
            setExact({ at: where, points: await live.exact(coefficients, asked.current.signal) });
        } catch (e) {
            if ((e as Error).name !== 'AbortError') setError(e);
        }
    };
    // Those of a link, which were moved before the page was there.
    useEffect(() => {
        if (!live || !Object.values(at).some((v) => v !== 0)) return;
        for (const [component, v] of Object.entries(at)) if (v !== 0) void load(+component);
        void settle(at);
    }, [frames, rounds]);
    const parts = moving.map((shape, p) => ({ shape, colour: GROUPS[p % GROUPS.length] }));
    const active = Object.entries(at).filter(([, v]) => v !== 0);
    const text = active.map(([k, v]) => t`component ${k}: ${v > 0 ? '+' : ''}${figure(v)} sd`).join(', ') || t`means`;
    const worst = known && Math.max(...known.points.map((p) => p.offset));
    const tracks = live ? Array.from({ length: count }, (_, i): [number, number[]] => [i + 1, PLACES]) : [...places];
    return (
        <div class="split">
            <figure class="shape tall">
                <View parts={parts} camera={linked} version={version} look={look} label={`${result.parts.map((p: any) => p.name).join(', ')}: ${text}`} />
                <figcaption class="row">{text}<span class="no-report"><PictureButtons parts={parts} camera={linked} look={look} name="structures" /></span></figcaption>
                <p class="row legend">{result.parts.map((part: any, p: number) => <span><svg viewBox="0 0 10 10" width="12" height="12" aria-hidden="true"><rect width="10" height="10" fill={GROUPS[p % GROUPS.length]} /></svg> {part.name}</span>)}</p>
            </figure>
            <div class="no-report">
                {tracks.map(([component, list]) => {
                    const energies = live ? [] : result.modes.filter((m: any) => m.component === component && typeof m.relativeEnergy === 'number').map((m: any) => m.relativeEnergy);
                    return (
                        <div class="field" key={component}>
                            <label for={`joint-${component}`}>{t`Component ${component}`} <span class="quiet">{t`${figure(100 * (result.explained[component - 1] ?? 0))} % of the variance, now ${figure(at[component] ?? 0)} sd${loading === component ? t`, loading…` : ''}`}</span></label>
                            <div class="row">
                                <div class="grow track">
                                    <input id={`joint-${component}`} type="range" min={list[0]} max={list.at(-1)} step={0.05} value={at[component] ?? 0}
                                        onInput={(e) => { setPlaying(0); setAt({ ...at, [component]: +e.currentTarget.value }); void load(component); }} onChange={(e) => void release(component, +e.currentTarget.value)} />
                                    <Spread title={t`Subjects along component ${component}, in standard deviations`} at={at[component] ?? 0} width={list.at(-1)!}
                                        values={result.scores.map((row: number[], i: number) => ({ value: row[component - 1] / (Math.sqrt(result.eigenvalues[component - 1]) || 1), name: result.subjects[i], group: result.groups?.[i] }))} />
                                </div>
                                <button aria-pressed={playing === component} onClick={async () => { if (playing === component) return setPlaying(0); await load(component); setPlaying(component); }}>{playing === component ? t`Stop` : t`Play`}</button>
                            </div>
                            {energies.length > 0 && <p class="help">{t`Relative energy at ${list.filter((v) => v).map((v) => figure(v)).join(' and ')} sd: at most ${figure(Math.max(...energies), 2)} (0: the shapes exist).`}</p>}
                        </div>
                    );
                })}
                <div class="actions">
                    {live && count < result.eigenvalues.length && <button onClick={() => setCount(count + 1)}>{t`Add a component`}</button>}
                    <button onClick={() => { setPlaying(0); setAt({}); }}>{t`Back to the means`}</button>
                </div>
                {known ? (
                    <p role="status" class={worst! > 0.5 ? 'wrong' : 'quiet'}>{t`Computed exactly${known.points.length > 1 ? `. ${known.points.map((p, i) => `${result.parts[i].name}: ${existence(p.offset)}`).join('. ')}` : `: ${existence(worst!)}`}.`}</p>
                ) : active.length > 0 && <p class="quiet">{t`Interpolated${active.length > 1 ? t`, with the displacements of several components added` : ''}${live ? t`: let the slider go for the exact shapes` : ''}.`}</p>}
                {error ? <ProblemBox error={error} /> : null}
                <p class="quiet">{result.positions ? t`Structures are where the model has them, in units of the root of their total area.${result.positions.components ? '' : t` How they move is in the results of the analysis, which are gone.`}` : t`Where structures are to each other is not in this model: they stand side by side, in their sizes.`}</p>
            </div>
        </div>
    );
}

/** The shapes of a subject, one of each structure. */
function Subject({ result, index }: { result: any; index: number }) {
    const cohort = result.inputs?.cohort ?? {};
    const n = result.subjects?.length ?? 0;
    const ids: string[] = result.parts.map((_: unknown, p: number) => cohort.surfaces?.[p * n + index]).filter(Boolean);
    return (
        <>
            <h3>{result.subjects[index]}</h3>
            <div class="gallery">{ids.map((id, p) => <Linked key={id} id={id} title={result.parts[p].name} colour={GROUPS[p % GROUPS.length]} />)}</div>
        </>
    );
}

/** A record of a model, or what a model page makes of one. */
const isLive = (result: any): boolean => typeof result.model?.id === 'string' && result.model.lmax <= LIVE_MAX;

export function Joint({ result, job }: { result: any; job?: api.Job }) {
    const [chosen, setChosen] = useKept('chosen', undefined, maybe(aPlace(result.subjects?.length ?? 0)));
    const live = isLive(result);
    const places = useMemo(() => (live ? new Map<number, number[]>() : placesOf(result.modes)), [result]);
    const loaded = useLoad(async () => {
        const frames = await load(result, places);
        return { frames, live: live ? liveOf(result.model.id, result.parts.map((p: any) => p.name), frames, places) : undefined };
    }, [result]);
    const more = Math.min(result.eigenvalues.length, Math.max(3, places.size + 2));
    return (
        <>
            {job && <p class="quiet">{t`${plural(result.subjects.length, 'subject')}, ${plural(result.parts.length, 'structure')} of each, ${plural(result.eigenvalues.length, 'component')}.`}</p>}
            <Shown of={loaded} label={t`the structures`}>{(of) => <Together result={result} frames={of.frames} places={places} live={of.live} />}</Shown>
            {job && !live && mayChange() && places.size < more && <p class="no-report"><a class="button" href={`${link('analyses', 'pca-parts')}?rerun=${job.id}&modes=${more}`}>{places.size ? t`More components to move` : t`Components to move`}</a></p>}
            <div class="split"><JointCharts result={result} chosen={chosen} onChoose={setChosen} /></div>
            {chosen !== undefined ? <Subject result={result} index={chosen} /> : <p class="quiet no-report">{t`Choose a mark among the scores to see the structures of that subject.`}</p>}
            <h2>{t`Structures`}</h2>
            <DataTable rows={[[t`structure`, t`weight`, t`share of the variance`, t`relative energy of its mean`, t`iterations`, t`converged`],
                ...result.parts.map((p: any) => [p.name, p.weight, p.share, p.relativeEnergy, p.iterations ?? '–', p.converged === undefined ? '–' : p.converged ? t`yes` : t`no`])]} />
            <div class="actions no-report">
                {result.parts.map((p: any) => <a class="button" href={link('shapes', p.mean.id)}>{t`Mean of ${p.name}`}</a>)}
                {result.model && <>
                    {job && <a class="button" href={link('models', result.model.id)}>{t`The model`}</a>}
                    {mayChange() && <>
                        <a class="button" href={`${link('analyses', 'project')}?model=${result.model.id}`}>{t`A new subject`}</a>
                        <a class="button" href={`${link('analyses', 'score')}?model=${result.model.id}`}>{t`Beside the norm`}</a>
                        <a class="button" href={`${link('analyses', 'sample')}?model=${result.model.id}`}>{t`Random subjects`}</a>
                    </>}
                </>}
            </div>
        </>
    );
}

/** A model of several structures: with the results of the analysis that made it, or without them once these are gone. */
export function JointModel({ model }: { model: api.Model }) {
    const loaded = useLoad(async (): Promise<any> => {
        const { job, surfaces } = model.madeFrom;
        try {
            if (job) return await api.results<'pca-parts'>(job);
        } catch (error) {
            if (!(error instanceof api.Failure) || ![404, 410].includes(error.problem.status)) throw error;
        }
        const parts = await Promise.all(model.parts!.map(async (p) => ({ ...p, mean: await api.get('/v1/surfaces/{id}', { id: p.mean }) })));
        return { ...model, model, parts, modes: [], subjects: model.labels, inputs: { cohort: { surfaces } } };
    }, [model.id]);
    return <Shown of={loaded} label={t`the structures`}>{(result) => <Joint result={result} />}</Shown>;
}
