// What the types refuse: each line below "@ts-expect-error" is an error, and the file does not compile where it is not.
import createClient from 'openapi-fetch';
import type { paths } from './api.js';

const client = createClient<paths>({ baseUrl: 'http://127.0.0.1:1' });
export const attempts = [
    // @ts-expect-error: it is a number
    () => client.POST('/v1/processes/encode/execution', { body: { inputs: { mesh: 'mesh-', smoothing: 'much' } } }),
    // @ts-expect-error: the other end must be given
    () => client.POST('/v1/processes/geodesic/execution', { body: { inputs: { from: 'surf-' } } }),
    // @ts-expect-error: there is no such process
    () => client.POST('/v1/processes/nothing/execution', { body: { inputs: {} } }),
    // @ts-expect-error: there is no such format
    () => client.GET('/v1/surfaces/{id}/mesh', { params: { path: { id: 'surf-' }, query: { format: 'gif' } } }),
];
