// Every process of the service, and a form for each made from its own description.
import { useEffect, useState } from 'preact/hooks';
import * as api from './api';
import { fromHere, link, useRoute } from './router';
import { mayChange, refreshJobs } from './state';
import { namesIn, withTerm } from './formula';
import { NumbersField, PartsField, PointsField, SendShape, levelsOf, namesOfPoints } from './fields';
import { t } from './i18n';
import { Page, ProblemBox, Shown, later, size, span, useLoad } from './ui';

const LandmarkField = later<any>(() => import('./landmark_field').then((m) => m.LandmarkField));
const GroupLandmarkField = later<any>(() => import('./landmark_field').then((m) => m.GroupLandmarkField));

/** Processes by what they are asked about, those of cohorts first; what is not named here stands last. */
const KINDS: [string, string[]][] = [
    [t`Of a cohort`, ['pca', 'mean', 'compare-groups', 'classify', 'regress', 'distances', 'neighbours', 'evaluate-model', 'report']],
    [t`Of subjects with several visits, sides or structures`, ['change', 'trajectories', 'asymmetry', 'pca-parts', 'classify-parts']],
    [t`Of a new shape, by what is known`, ['score', 'project', 'train', 'train-parts', 'predict', 'modes', 'sample']],
    [t`Of two shapes or three`, ['geodesic', 'register', 'shoot', 'transport', 'transfer']],
    [t`Of a mesh or a segmentation`, ['extract', 'repair', 'mirror', 'encode', 'invert']],
];

function sorted(items: api.Item<'processes'>[]): [string, api.Item<'processes'>[]][] {
    const known = new Set(KINDS.flatMap(([, ids]) => ids));
    const kinds = KINDS.map(([title, ids]): [string, api.Item<'processes'>[]] => [title, ids.flatMap((id) => items.filter((p) => p.id === id))]);
    return [...kinds, [t`Others`, items.filter((p) => !known.has(p.id))] as [string, api.Item<'processes'>[]]].filter(([, list]) => list.length > 0);
}

export function Analyses() {
    const all = useLoad(() => api.list('processes'), []);
    const { query } = useRoute();
    const models = useLoad(() => api.list('models', { limit: 20 }), []);
    const given = query.toString();
    return (
        <Page title={t`Analyses`}>
            {models.value && models.value.items.length > 0 && (
                <section>
                    <h2>{t`Models`}</h2>
                    <ul class="plain">{models.value.items.map((m) => (
                        <li><a href={link('models', m.id)}>{m.name || m.madeFrom?.cohort || m.id}</a> <span class="quiet">{t`${m.subjects} shapes, ${m.components} components, degree ${m.lmax}`}</span></li>
                    ))}</ul>
                </section>
            )}
            <Shown of={all}>{(page) => sorted(page.items).map(([title, list]) => (
                <section key={title}>
                    <h2>{title}</h2>
                    <div class="cards">{list.map((p) => (
                        <a class="card" href={link('analyses', p.id) + (given ? `?${given}` : '')}>
                            <h3 lang="en">{p.title}</h3><p class="quiet" lang="en">{p.description}</p>
                        </a>
                    ))}</div>
                </section>
            ))}</Shown>
        </Page>
    );
}

// ---- What an input can be -------------------------------------------------------------------------------------------

type Kind = 'cohort' | 'model' | 'volume' | 'shape' | 'within' | 'shapes' | 'parts' | 'landmarks' | 'group landmarks' | 'points' | 'weights' | 'choice' | 'choices' | 'switch' | 'number' | 'numbers' | 'texts' | 'text' | 'json';

const alternatives = (s: api.Schema): api.Schema[] => (s.oneOf ? s.oneOf.flatMap(alternatives) : [s]);
const hasType = (s: api.Schema, type: string): boolean => (Array.isArray(s.type) ? s.type.includes(type) : s.type === type);

const isShape = (pattern?: string): boolean => /surf|mesh/.test(pattern ?? '');

/** Of an input that is an object around one shape, such as {toward: ..}: the name of that member. */
export const within = (schema: api.Schema): string | undefined => alternatives(schema)
    .filter((f) => f.required?.length === 1 && isShape(f.properties?.[f.required[0]]?.pattern)).map((f) => f.required![0])[0];

const patternOf = (schema: api.Schema): string =>
    alternatives(schema).map((f) => f.pattern ?? f.items?.pattern ?? f.properties?.[f.required?.[0] ?? '']?.pattern ?? '').find(isShape) ?? '';

/** The two inputs whose shapes landmarks are of: both lists that must be given. */
export const endsOf = (schema: api.Schema): [string, string] | undefined => alternatives(schema)
    .filter((f) => f.required?.length === 2 && f.properties?.heldOut).map((f) => f.required as [string, string])[0];

/** Landmarks of all members of a group: the same vertices, or points of each. */
const isOfGroup = (schema: api.Schema): boolean => alternatives(schema).some((f) => f.properties?.vertices && f.properties.points);

export function kindOf(name: string, schema: api.Schema): Kind {
    const forms = alternatives(schema);
    if (isOfGroup(schema)) return 'group landmarks';
    if (forms.some((f) => typeof f.additionalProperties === 'object' && isShape(f.additionalProperties.pattern))) return 'parts';
    if (endsOf(schema)) return 'landmarks';
    if (name === 'at') return 'points';
    if (forms.length === 1 && hasType(schema, 'object') && typeof schema.additionalProperties === 'object') return 'weights';
    const pattern = forms.map((f) => f.pattern ?? '').join(' ');
    if (name === 'cohort') return 'cohort';
    if (/model-/.test(pattern)) return 'model';
    if (/vol-|volume-/.test(pattern) || name === 'volume') return 'volume';
    if (forms.length === 1 && hasType(schema, 'string') && isShape(pattern)) return 'shape';
    if (within(schema)) return 'within';
    if (forms.some((f) => hasType(f, 'array') && isShape(f.items?.pattern))) return 'shapes';
    if (forms.some((f) => hasType(f, 'array') && f.items?.enum)) return 'choices';
    if (forms.length === 1 && schema.enum) return 'choice';
    if (hasType(schema, 'boolean')) return 'switch';
    if (forms.length === 1 && (hasType(schema, 'integer') || hasType(schema, 'number'))) return 'number';
    if (forms.length === 1 && hasType(schema, 'array') && schema.items && (hasType(schema.items, 'number') || hasType(schema.items, 'integer'))) return 'numbers';
    if (forms.length === 1 && hasType(schema, 'array') && schema.items && hasType(schema.items, 'string')) return 'texts';
    if (forms.length === 1 && hasType(schema, 'string')) return 'text';
    return 'json';
}

/** What was typed, as the service wants it; undefined: nothing. */
export function valueOf(kind: Kind, text: string, schema: api.Schema): unknown {
    const clean = text.trim();
    if (clean === '') return undefined;
    const parts = () => clean.split(/[,;\s]+/).filter(Boolean);
    if (kind === 'number') return Number(clean);
    if (kind === 'within' && isShape(clean)) return { [within(schema)!]: clean };
    if (kind === 'numbers') return parts().map(Number);
    if (kind === 'shapes') return parts();
    if (kind === 'choices') return parts();
    if (kind === 'texts') return clean.split(/[,;]+/).map((t) => t.trim()).filter(Boolean);
    if (kind === 'switch') return clean === 'true';
    if (['json', 'within', 'landmarks', 'group landmarks', 'parts', 'points', 'weights'].includes(kind)) {
        try {
            return JSON.parse(clean);
        } catch {
            return clean;
        }
    }
    return clean;
}

const textOf = (value: unknown): string => value === undefined || value === null ? ''
    : Array.isArray(value) && value.every((v) => typeof v !== 'object') ? value.join(', ')
        : typeof value === 'object' ? JSON.stringify(value) : `${value}`;

interface Choices { cohorts: string[]; models: { id: string; text: string }[]; shapes: { id: string; name: string }[]; volumes: { id: string; name: string }[] }

const CHOICES_MAX = 2000; // of each kind, the last ones

async function choicesFor(kinds: Kind[]): Promise<Choices> {
    const some = async <N extends api.List>(wanted: boolean, name: N): Promise<api.Item<N>[]> => {
        let found: api.Item<N>[] = [];
        if (wanted) await api.listAll(name, (items) => { found = items; }, () => found.length >= CHOICES_MAX);
        return found;
    };
    const shapes = kinds.some((k) => ['shape', 'shapes', 'within', 'parts'].includes(k));
    const [cohorts, models, volumes, meshes, surfaces] = await Promise.all([
        some(kinds.includes('cohort'), 'cohorts'), some(kinds.includes('model'), 'models'),
        some(kinds.includes('volume'), 'volumes'), some(shapes, 'meshes'), some(shapes, 'surfaces'),
    ]);
    return {
        cohorts: cohorts.map((c) => c.name), volumes,
        models: models.map((m) => ({ id: m.id, text: t`${m.name || m.madeFrom?.cohort || m.id}, ${m.subjects} shapes, degree ${m.lmax}` })),
        shapes: [...meshes.map((m) => ({ id: m.id, name: `${m.name || m.id} (mesh)` })), ...surfaces.map((s) => ({ id: s.id, name: `${s.name || s.id} (surface, degree ${s.lmax})` }))],
    };
}

/** The rest of the form, which some fields depend on. */
interface Around {
    process: string; texts: Record<string, string>; members: api.Member[];
    /** Names of the parts of the model, if it has some. */
    parts?: string[];
    /** A mesh was sent from the form: it is among the choices. */
    sent: (shape: { id: string; name: string }) => void;
}

function Field({ input, kind, text, set, choices, hint, around }: {
    input: api.Input; kind: Kind; text: string; set: (text: string) => void; choices: Choices; hint?: string; around: Around;
}) {
    const id = `in-${input.name}`;
    const { schema } = input;
    const shared = { id, 'aria-describedby': `${id}-help`, required: input.required };
    const range = schema.minimum !== undefined || schema.maximum !== undefined ? t`${schema.minimum ?? ''} to ${schema.maximum ?? ''}` : '';
    const wanted = new RegExp(patternOf(schema));
    const shapes = choices.shapes.filter((s) => wanted.test(s.id));
    const options = alternatives(schema).flatMap((f) => f.enum ?? f.items?.enum ?? []).filter((v, i, all) => all.indexOf(v) === i);
    const select = (list: [string, string][], none: string) => (
        <select {...shared} value={text} onChange={(e) => set(e.currentTarget.value)}>
            {(!input.required || !text) && <option value="">{none}</option>}
            {/* What a link brings may be older than the lists. */}
            {text && !list.some(([value]) => value === text) && <option value={text}>{text}</option>}
            {list.map(([value, shown]) => <option value={value}>{shown}</option>)}
        </select>
    );
    let field;
    if (kind === 'cohort') field = select(choices.cohorts.map((c) => [c, c]), input.required ? t`choose a cohort` : 'none');
    else if (kind === 'model') field = select(choices.models.map((m) => [m.id, m.text]), input.required ? t`choose a model` : 'none');
    else if (kind === 'volume') field = select(choices.volumes.map((v) => [v.id, v.name || v.id]), t`choose a segmentation`);
    else if (kind === 'shape' || kind === 'within') {
        field = <SendShape able={wanted.test('mesh-00000000000000000000000000000000')} sent={(s) => { around.sent(s); set(s.id); }}>{select(shapes.map((s) => [s.id, s.name]), input.required ? t`choose a shape` : 'none')}</SendShape>;
    } else if (kind === 'shapes') {
        field = (
            <SendShape able={wanted.test('mesh-00000000000000000000000000000000')} sent={(s) => { around.sent(s); set(text ? `${text},${s.id}` : s.id); }}>
            <select {...shared} multiple size={6} onChange={(e) => set([...e.currentTarget.selectedOptions].map((o) => o.value).join(','))}>
                {shapes.map((s) => <option value={s.id} selected={text.includes(s.id)}>{s.name}</option>)}
            </select>
            </SendShape>
        );
    } else if (kind === 'choice') field = select(options.map((o) => [`${o}`, `${o}`]), 'default');
    else if (kind === 'choices') {
        const chosen = new Set(text.split(/[,\s]+/).filter(Boolean));
        return (
            <fieldset aria-describedby={`${id}-help`}><legend lang="en">{input.title}</legend>
                {options.map((o) => (
                    <label class="check"><input type="checkbox" checked={chosen.has(`${o}`)} onChange={() => {
                        if (!chosen.delete(`${o}`)) chosen.add(`${o}`);
                        set([...chosen].join(', '));
                    }} /> {o}</label>
                ))}
                <p class="help" id={`${id}-help`}>{input.description}</p>
            </fieldset>
        );
    } else if (kind === 'switch') {
        return (
            <div class="field">
                <label class="check"><input type="checkbox" {...shared} required={false} checked={text === 'true'} onChange={(e) => set(`${e.currentTarget.checked}`)} /> {input.title}</label>
                <p class="help" id={`${id}-help`}>{input.description}</p>
            </div>
        );
    } else if (kind === 'landmarks') {
        const ends = endsOf(schema)!;
        return (
            <fieldset aria-describedby={`${id}-help`} class="wide"><legend lang="en">{input.title} <span class="quiet">{t`optional`}</span></legend>
                <LandmarkField key={ends.map((end) => around.texts[end]).join()} ends={ends} ids={ends.map((end) => around.texts[end] ?? '')} text={text} set={set} />
                <p class="help" id={`${id}-help`}>{t`Click places that correspond on both shapes, in the same order. Those held out do not guide: they tell how well the rest corresponds.`}</p>
            </fieldset>
        );
    } else if (kind === 'group landmarks') {
        const ids = around.members.length ? around.members.map((m) => m.id) : valueOf('shapes', around.texts.surfaces ?? '', schema) as string[] | undefined ?? [];
        return (
            <fieldset aria-describedby={`${id}-help`} class="wide"><legend lang="en">{input.title} <span class="quiet">{t`optional`}</span></legend>
                <GroupLandmarkField key={ids.join()} ids={ids} text={text} set={set} />
                <p class="help" id={`${id}-help`}>{t`Points that correspond in all members, in the same order. Those held out do not guide: they tell how well the rest corresponds.`}</p>
            </fieldset>
        );
    } else if (kind === 'parts') {
        return (
            <fieldset aria-describedby={`${id}-help`}><legend lang="en">{input.title}</legend>
                <PartsField id={id} names={around.parts ?? []} shapes={choices.shapes} text={text} set={set} sent={around.sent} />
                <p class="help" id={`${id}-help`}>{t`A shape for each structure of the model. Each is registered to the mean of its structure.`}</p>
            </fieldset>
        );
    } else if (kind === 'points' || kind === 'weights') {
        return (
            <fieldset aria-describedby={`${id}-help`}><legend lang={kind === 'points' ? undefined : 'en'}>{kind === 'points' ? t`Predict shapes at` : input.title} <span class="quiet">{t`optional`}</span></legend>
                {kind === 'points' ? <PointsField id={id} names={namesOfPoints(around.process, around.texts)} members={around.members} text={text} set={set} />
                    : <NumbersField id={id} names={levelsOf(around.members, around.texts.by || 'label')} text={text} set={set} />}
                <p class="help" id={`${id}-help`}>{kind === 'points' ? t`What is left empty is at its mean, or at its first level.` : input.description}</p>
            </fieldset>
        );
    } else if (kind === 'number') {
        field = <input {...shared} type="number" step={hasType(schema, 'integer') ? 1 : 'any'} min={schema.minimum} max={schema.maximum} value={text} onInput={(e) => set(e.currentTarget.value)} />;
    } else field = <input {...shared} type="text" value={text} placeholder={input.name === 'formula' ? t`shape ~ age + sex` : undefined} onInput={(e) => set(e.currentTarget.value)} />;
    const listed = input.name === 'covariates' && kind === 'texts';
    const terms = input.name === 'formula' ? namesOfMembers(around.members).filter((name) => !name.includes('`') && !namesIn(text).includes(name))
        : listed ? numbersOf(around.members).filter((name) => !/[,;]/.test(name) && !(valueOf(kind, text, schema) as string[] | undefined)?.includes(name)) : [];
    const withName = (name: string) => (listed ? [...(valueOf(kind, text, schema) as string[] | undefined ?? []), name].join(', ') : withTerm(text, name));
    return (
        <div class="field">
            <label for={id}>{input.title}{input.required ? '' : <span class="quiet"> {t`optional`}</span>}</label>
            {field}
            {terms.length > 0 && <div class="actions">{terms.slice(0, 20).map((name) => <button type="button" onClick={() => set(withName(name))}>{`+ ${name}`}</button>)}</div>}
            <p class="help" id={`${id}-help`}>{input.description}{range ? t` From ${range}.` : ''}{hint ? ` ${hint}` : ''}</p>
        </div>
    );
}

/** What the members of a cohort are told apart by, for inputs that name it. */
function namesOfMembers(members: api.Member[]): string[] {
    const known = new Set(members.flatMap((m) => Object.keys(m.covariates ?? {})));
    const own = (['label', 'time', 'side'] as const).filter((name) => members.some((m) => m[name] !== null && m[name] !== undefined));
    return [...own, ...known];
}

/** Covariates that can be regressed out, or count beside shape: numbers, true and false. */
const numbersOf = (members: api.Member[]): string[] => [...new Set(members.flatMap((m) => Object.keys(m.covariates ?? {})))]
    .filter((name) => members.every((m) => !['string', 'object'].includes(typeof (m.covariates?.[name] ?? undefined))));

function columnsOf(members: api.Member[]): string {
    const all = namesOfMembers(members);
    return all.length ? t`Members of this cohort have ${all.slice(0, 40).join(', ')}.` : '';
}

/** The inputs as they are sent: what is not the default, and what must be there. */
function inputsOf(process: api.Process, kinds: Kind[], texts: Record<string, string>): Record<string, unknown> {
    const inputs: Record<string, unknown> = {};
    process.inputs.forEach((input, i) => {
        const value = valueOf(kinds[i], texts[input.name] ?? '', input.schema);
        const usual = JSON.stringify(value) === JSON.stringify(input.schema.default);
        if (value !== undefined && (!usual || input.required)) inputs[input.name] = value;
    });
    return inputs;
}

const PAUSE_MS = 400; // after the last change, before an estimate is asked for

const about = (seconds: number): string => (seconds < 1 ? t`less than a second` : t`about ${span(seconds < 10 ? seconds : +seconds.toPrecision(2))}`);

/** What the service expects of these inputs, or why it would refuse them, before anything is started. */
function Expected({ process, kinds, texts, parts }: { process: api.Process; kinds: Kind[]; texts: Record<string, string>; parts?: string[] }) {
    const inputs = inputsOf(process, kinds, texts);
    const lacks = kinds.includes('parts') && parts && !inputs.cohort ? parts.filter((name) => !(inputs.parts as Record<string, string> | undefined)?.[name]) : [];
    const whole = lacks.length === 0 && process.inputs.every((i) => !i.required || inputs[i.name] !== undefined);
    const asked = JSON.stringify(inputs);
    const [found, setFound] = useState<{ asked: string; estimate?: api.Estimate; error?: unknown }>();
    useEffect(() => {
        if (!whole) return setFound(undefined);
        const stop = new AbortController();
        const timer = setTimeout(() => {
            api.estimate(process.id, JSON.parse(asked), stop.signal).then((estimate) => setFound({ asked, estimate }),
                (error) => !stop.signal.aborted && setFound({ asked, error }));
        }, PAUSE_MS);
        return () => {
            clearTimeout(timer);
            stop.abort();
        };
    }, [process.id, asked, whole]);
    if (!whole || !found) return <p class="quiet" role="status">{whole ? t`Estimating…` : lacks.length ? t`Choose a shape for ${lacks.join(', ')}.` : ''}</p>;
    const problem = found.error instanceof api.Failure ? found.error.problem : undefined;
    if (problem?.status === 422) {
        return <p class="wrong" role="status">{[...(problem.errors ?? []).map((e) => `${e.pointer.replace('/inputs/', '').replace('/inputs', '')}: ${e.detail}`.replace(/^: /, '')), ...(problem.errors ? [] : [problem.detail])].join(' ')}</p>;
    }
    const { estimate } = found;
    if (!estimate) return <p class="quiet" role="status">{t`No estimate.`}</p>;
    const seconds = estimate.estimatedSeconds;
    return (
        <p class="quiet" role="status" aria-busy={found.asked !== asked}>
            {seconds === null ? t`How long it takes depends on more than its inputs.` : t`Takes ${about(seconds)} of one processor, give or take a factor of three; nothing if it is known already.`}
            {estimate.estimatedBytes !== null && t` Needs about ${size(estimate.estimatedBytes)} of memory; a job may have ${size(estimate.memoryLimit)}.`}
        </p>
    );
}

/** Inputs that most need not look at. */
const FINE = /^(mixedRoutes|fields|tolerance|maxIterations|seed|handedness|method|penalty|start|exact|covariance|refit|sizeWeight|validation|symmetric|degree|initial|center|smoothing|distortion|components)$/;

const usualName = (process: api.Process, texts: Record<string, string>): string | undefined => (texts.cohort ? `${process.title}: ${texts.cohort}` : undefined);

export function Form({ id }: { id: string }) {
    const { query } = useRoute();
    const loaded = useLoad(async () => {
        const process = await api.process(id);
        const kinds = process.inputs.map((i) => kindOf(i.name, i.schema));
        const job = query.get('rerun'); // not "from": inputs have that name
        const before = job ? (await api.job(job)).inputs ?? {} : {};
        return { process, kinds, choices: await choicesFor(kinds), before };
    }, [id]);
    const [texts, setTexts] = useState<Record<string, string>>({});
    const [name, setName] = useState('');
    const members = useLoad(async () => (texts.cohort ? (await api.cohort(texts.cohort)).members ?? [] : []), [texts.cohort]).value ?? [];
    // Parts are the model's: a model of one structure takes a surface, one of several takes one for each.
    const model = texts.model ?? '';
    const partsOfModel = useLoad(async (signal) => (/^model-/.test(model) ? (await api.get('/v1/models/{id}', { id: model }, signal)).parts?.map((p) => p.name) : undefined), [model]).value;
    const [sent, setSent] = useState<{ id: string; name: string }[]>([]);
    const [error, setError] = useState<unknown>();
    const [busy, setBusy] = useState(false);
    useEffect(() => {
        if (!loaded.value) return;
        const { process, before } = loaded.value;
        const start: Record<string, string> = {};
        for (const input of process.inputs) {
            const old = before[input.name];
            const one = input.name === 'parts' && Array.isArray(old) && old.length === 1 ? old[0] : old; // subjects, of which the form takes one
            const was = one && typeof one === 'object' && (one.surfaces || one.subjects) && one.name ? one.name : one;
            start[input.name] = query.get(input.name) ?? textOf(within(input.schema) && was && typeof was === 'object' ? was[within(input.schema)!] ?? was : was ?? input.schema.default);
            if (input.name === 'lmax' && !start.lmax && query.get('cohort')) start.lmax = '15';
        }
        setTexts(start);
    }, [loaded.value]);
    /** What an input of a shape means where the model has parts, and the other way round: nothing. */
    const isOfOther = (input: api.Input, kind: Kind): boolean => (partsOfModel ? /^surfaces?$/.test(input.name) : kind === 'parts' || input.name === 'by');
    const isAsked = (input: api.Input, kind: Kind, kinds: Kind[]): boolean => !(kinds.includes('parts') && isOfOther(input, kind))
        && !(['shapes', 'parts'].includes(kind) && !input.required && kinds.includes('cohort') && texts.cohort); // the other way to name a group
    const asked = (process: api.Process, kinds: Kind[]): Record<string, string> =>
        Object.fromEntries(process.inputs.map((input, i) => [input.name, isAsked(input, kinds[i], kinds) ? texts[input.name] ?? '' : '']));
    const submit = async (event: Event) => {
        event.preventDefault();
        const { process, kinds } = loaded.value!;
        const inputs = inputsOf(process, kinds, asked(process, kinds));
        setBusy(true);
        setError(undefined);
        const onward = fromHere();
        try {
            const job = await api.execute(id, inputs, name.trim() || usualName(process, texts));
            refreshJobs();
            onward(link('jobs', job.id));
        } catch (e) {
            setError(e);
        }
        setBusy(false);
    };
    return (
        <Shown of={loaded} page label={t`the form`}>{({ process, kinds, choices }) => {
            const fields = process.inputs.map((input, i) => ({ input, kind: kinds[i] })).filter(({ input, kind }) => isAsked(input, kind, kinds))
                .sort((a, b) => +(b.kind === 'cohort') - +(a.kind === 'cohort'));
            const all = { ...choices, shapes: [...sent, ...choices.shapes] };
            const show = ({ input, kind }: (typeof fields)[0]) => (
                <Field key={input.name} input={input} kind={kind} choices={all} text={texts[input.name] ?? ''} hint={input.name === 'formula' ? columnsOf(members) : undefined} around={{ process: id, texts, members, parts: partsOfModel, sent: (shape) => setSent((before) => [shape, ...before]) }}
                    set={(text) => setTexts((now) => ({ ...now, [input.name]: text }))} />
            );
            const fine = fields.filter((f) => FINE.test(f.input.name) && !f.input.required);
            return (
                <Page title={process.title}>
                    <p lang="en">{process.description}</p>
                    <form onSubmit={submit} class="form">
                        {fields.filter((f) => !fine.includes(f)).map(show)}
                        {fine.length > 0 && <details><summary>{t`Options that are good as they are`}</summary>{fine.map(show)}</details>}
                        <div class="field"><label for="job-name">{t`Name`} <span class="quiet">{t`optional`}</span></label>
                            <input id="job-name" type="text" maxLength={255} value={name} placeholder={usualName(process, texts)} onInput={(e) => setName(e.currentTarget.value)} />
                            <p class="help">{t`For the list of jobs and the report.`}</p></div>
                        <Expected process={process} kinds={kinds} texts={asked(process, kinds)} parts={partsOfModel} />
                        {error ? <ProblemBox error={error} /> : null}
                        <button class="main" disabled={busy || !mayChange()}>{mayChange() ? t`Start` : t`A viewer may not start analyses`}</button>
                    </form>
                </Page>
            );
        }}</Shown>
    );
}
