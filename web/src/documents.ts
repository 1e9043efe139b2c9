// What the service takes and answers, by the types that make web makes of its description (service.d.ts): a member that
// the API does not have fails the type check (contract.ts). Pages see jobs and descriptions of processes as api.ts gives them.
import type { components, paths } from './service';

type Schemas = components['schemas'];

/** Routes that are read as JSON, and what they answer. */
type Answers = { [P in keyof paths]: paths[P] extends { get: { responses: { 200: { content: { 'application/json': infer T } } } } } ? T : never };
export type Route = { [P in keyof Answers]: [Answers[P]] extends [never] ? never : P }[keyof Answers];
export type Answer<P extends Route> = Answers[P];

/** Lists by the last part of their route. */
export type List = { [P in Route]: P extends `/v1/${infer Name}` ? Answer<P> extends { items: unknown[] } | { jobs: unknown[] } | { processes: unknown[] } ? Name : never : never }[Route];
type ItemsOf<L> = L extends { items: (infer T)[] } | { jobs: (infer T)[] } | { processes: (infer T)[] } ? T : never;
export type Item<N extends List> = ItemsOf<Answer<`/v1/${N}` & Route>>;

export type Method = 'post' | 'put' | 'patch' | 'delete';
/** Routes that take a method; what they take and answer as JSON. */
export type SendRoute<M extends Method> = { [P in keyof paths]: paths[P] extends { [K in M]: { responses: unknown } } ? P : never }[keyof paths];
export type Sent<P extends keyof paths, M extends Method> = paths[P] extends { [K in M]: { requestBody: { content: { 'application/json': infer T } } } } ? T : undefined;
type Told<R> = R extends { 201: { content: { 'application/json': infer T } } } ? T : R extends { 200: { content: { 'application/json': infer T } } } ? T : undefined;
export type Received<P extends keyof paths, M extends Method> = paths[P] extends { [K in M]: { responses: infer R } } ? Told<R> : never;

export type Problem = Partial<Schemas['Problem']> & Pick<Schemas['Problem'], 'status' | 'title'> & { code: string; detail: string };
export type Mesh = Schemas['Mesh'];
export type MeshProblem = Mesh['report']['problems'][number];
export type Surface = Schemas['Surface'];
export type Volume = Schemas['Volume'];
export type Member = Schemas['CohortMember'];
export type Cohort = Schemas['Cohort'] & { etag?: string };
export type Model = Schemas['Model'];
export type ModelSummary = Schemas['ModelSummary'];
export type JobDocument = Schemas['Job'];
export type JobStatus = Schemas['JobStatus'];
export type Estimate = Schemas['Estimate'];
export type Imported = Schemas['Import'];

// ---- Processes -------------------------------------------------------------------------------------------------------

export type ProcessId = keyof Schemas extends infer K ? K extends `${infer P}Outputs` ? P : never : never;
export type Inputs<P extends ProcessId> = Schemas[`${P}Inputs`];

/** Outputs that the description calls an object, and that are records. */
interface Records { surface: Surface; mesh: Mesh; model: Model; surfaces: Surface[] }
type Open<T> = T extends readonly (infer E)[] ? Open<E>[] : T extends object ? (string extends keyof T ? Record<string, any> : { [K in keyof T]: Open<T[K]> }) : T;
type OutputOf<P, K, T> = P extends 'regress' | 'trajectories' ? Open<T> : K extends keyof Records ? Records[K] : Open<T>;

/** Plain results of a process. Of objects whose members the description does not list, any is read. */
export type Outputs<P extends ProcessId> = { [K in keyof Schemas[`${P}Outputs`]]-?: OutputOf<P, K, Exclude<Schemas[`${P}Outputs`][K], undefined>> };
