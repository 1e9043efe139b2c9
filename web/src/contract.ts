// That the types hold calls against the description of the API: each line below would be wrong, and the type check fails
// where one is not found to be. Nothing of this is run or bundled.
import * as api from './api';

export async function wrong(): Promise<void> {
    const mesh = await api.get('/v1/meshes/{id}', { id: '' });
    // @ts-expect-error: a mesh has no such member
    void mesh.verticces;
    // @ts-expect-error: nor has its report
    void mesh.report.analyzable;
    // @ts-expect-error: there is no such route
    await api.get('/v1/mesh/{id}', { id: '' });
    // @ts-expect-error: nor such a list
    await api.list('analyses');
    // @ts-expect-error: items of a list have what their schema has
    void (await api.list('models')).items[0].variance;
    // @ts-expect-error: what is sent too
    await api.send('post', '/v1/cohorts', {}, { name: '', members: [{ id: '', side: 'middle' }] });
    // @ts-expect-error: a job is not patched by PUT
    await api.send('put', '/v1/jobs/{id}', { id: '' }, { name: '' });
    // @ts-expect-error: no such process
    await api.run('compare', { cohort: '' });
    // @ts-expect-error: no such input
    await api.run('compare-groups', { cohort: '', permutation: 9 });
    const found = await api.run('change', { cohort: '' });
    // @ts-expect-error: no such output
    void found.directional;
    // @ts-expect-error: nor such a part of one
    void found.change.values;
    // @ts-expect-error: nor such a column
    void found.perSubject[0].label;
}
