#!/usr/bin/python3
"""OGC API - Processes 1.0 (OGC 18-062r2), spoken by OWSLib against the daemon: standard.py URL

Every answer is validated against schemas written from the text of the standard. What is tested, by the standard's
names of its requirements (/req/CLASS/..); each line of TAP begins with the requirement that it tests:

  core: landingpage-op, landingpage-success, api-definition-op, api-definition-success, conformance-op,
        conformance-success, http (301-less 404 and 405), process-list, process-list-success, pl-limit-definition,
        pl-limit-response, pl-links, process, process-success, process-exception/no-such-process, process-execute-op,
        process-execute-request, process-execute-inputs (by value, qualified, by reference), process-execute-input-array,
        process-execute-input-inline-object, process-execute-input-validation, process-execute-default-outputs,
        process-execute-default-execution-mode, process-execute-auto-execution-mode,
        process-execute-sync-document, process-execute-sync-raw-value-one, process-execute-sync-raw-value-multi,
        process-execute-sync-raw-ref, process-execute-success-async, job, job-success, job-exception-no-such-job,
        job-results, job-results-async-document, job-results-exception/no-such-job,
        job-results-exception/results-not-ready, job-results-failed
  ogc-process-description: json-encoding, inputs-def, input-def, outputs-def, output-def
  json: definition
  oas30: oas-definition-1, oas-definition-2, oas-impl
  job-list: job-list-op, job-list-success, type-definition, type-response, processID-definition, processID-mandatory,
        processid-response, status-definition, status-response, datetime-definition, datetime-response,
        duration-definition, duration-response, limit-definition, limit-response, links
  dismiss: job-dismiss-op, job-dismiss-success

Not tested, since the service has no such inputs: process-execute-input-inline-bbox and -binary. Callbacks and HTML are
classes of their own that the service does not claim.
"""
import datetime
import json
import struct
import sys
import time

import jsonschema
import requests
from owslib.ogcapi.processes import Processes
from owslib.util import http_post

OGC = 'http://www.opengis.net/def/rel/ogc/1.0/'
EXCEPTION = 'http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/'

# ---- Schemas ----------------------------------------------------------------------------------------------------------

LINK = {'type': 'object', 'required': ['href'], 'properties': {
    'href': {'type': 'string', 'minLength': 1}, 'rel': {'type': 'string'}, 'type': {'type': 'string'},
    'hreflang': {'type': 'string'}, 'title': {'type': 'string'}}}
LINKS = {'type': 'array', 'items': LINK}
LANDING = {'type': 'object', 'required': ['links'], 'properties': {
    'title': {'type': 'string'}, 'description': {'type': 'string'}, 'links': LINKS}}
CONFORMANCE = {'type': 'object', 'required': ['conformsTo'], 'properties': {
    'conformsTo': {'type': 'array', 'items': {'type': 'string', 'pattern': '^http://www.opengis.net/spec/'}}}}
# A schema object of OpenAPI 3.0: one type, flags for exclusive limits, and no keyword of later drafts.
TYPED = {'type': 'object', 'properties': {
    'type': {'enum': ['array', 'boolean', 'integer', 'number', 'object', 'string']},
    'nullable': {'type': 'boolean'}, 'exclusiveMinimum': {'type': 'boolean'}, 'minimum': {'type': 'number'},
    'enum': {'type': 'array', 'minItems': 1}, 'required': {'type': 'array', 'minItems': 1},
    'items': {'$ref': '#/definitions/typed'}, 'not': {'$ref': '#/definitions/typed'},
    'properties': {'type': 'object', 'additionalProperties': {'$ref': '#/definitions/typed'}},
    'additionalProperties': {'anyOf': [{'type': 'boolean'}, {'$ref': '#/definitions/typed'}]},
    'oneOf': {'type': 'array', 'items': {'$ref': '#/definitions/typed'}},
    'anyOf': {'type': 'array', 'items': {'$ref': '#/definitions/typed'}}},
    'not': {'anyOf': [{'required': [name]} for name in ('const', '$schema', 'prefixItems', 'examples', '$defs')]}}
DESCRIBED = {'type': 'object', 'required': ['schema'], 'properties': {
    'title': {'type': 'string', 'minLength': 1}, 'description': {'type': 'string', 'minLength': 1},
    'minOccurs': {'type': 'integer', 'minimum': 0}, 'maxOccurs': {'type': 'integer', 'minimum': 1},
    'schema': {'$ref': '#/definitions/typed'}}}
SUMMARY = {'type': 'object', 'required': ['id', 'version', 'jobControlOptions', 'outputTransmission', 'links'],
           'properties': {
               'id': {'type': 'string'}, 'title': {'type': 'string'}, 'description': {'type': 'string'},
               'version': {'type': 'string'},
               'jobControlOptions': {'type': 'array', 'items': {'enum': ['sync-execute', 'async-execute', 'dismiss']}},
               'outputTransmission': {'type': 'array', 'items': {'enum': ['value', 'reference']}}, 'links': LINKS}}
PROCESS = {'definitions': {'typed': TYPED}, 'allOf': [SUMMARY, {'required': ['inputs', 'outputs'], 'properties': {
    'inputs': {'type': 'object', 'additionalProperties': DESCRIBED},
    'outputs': {'type': 'object', 'additionalProperties': DESCRIBED}}}]}
PROCESSES = {'type': 'object', 'required': ['processes', 'links'], 'properties': {
    'processes': {'type': 'array', 'items': SUMMARY}, 'links': LINKS}}
MOMENT = {'type': 'string', 'pattern': r'^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z$'}
STATUS = {'type': 'object', 'required': ['jobID', 'status', 'type'], 'properties': {
    'jobID': {'type': 'string'}, 'processID': {'type': 'string'}, 'type': {'enum': ['process']},
    'status': {'enum': ['accepted', 'running', 'successful', 'failed', 'dismissed']}, 'message': {'type': 'string'},
    'created': MOMENT, 'started': MOMENT, 'finished': MOMENT, 'updated': MOMENT,
    'progress': {'type': 'integer', 'minimum': 0, 'maximum': 100}, 'links': LINKS},
    'additionalProperties': {'not': {'type': 'null'}}}
JOBS = {'type': 'object', 'required': ['jobs', 'links'], 'properties': {
    'jobs': {'type': 'array', 'items': STATUS}, 'links': LINKS}}
EXCEPTIONS = {'type': 'object', 'required': ['type'], 'properties': {
    'type': {'type': 'string'}, 'title': {'type': 'string'}, 'status': {'type': 'integer'},
    'detail': {'type': 'string'}, 'instance': {'type': 'string'}}}
# Of a document of results: a simple value or an array, a qualified value, or a link.
RESULTS = {'type': 'object', 'additionalProperties': {'anyOf': [
    {'type': ['string', 'number', 'boolean', 'array']},
    {'type': 'object', 'required': ['value'], 'additionalProperties': False, 'properties': {
        'value': {'not': {'type': 'null'}}, 'mediaType': {'type': 'string'}, 'encoding': {'type': 'string'},
        'schema': {}}},
    {'allOf': [LINK, {'additionalProperties': False, 'properties': dict.fromkeys(LINK['properties'], {})}]}]}}
OPENAPI = {'type': 'object', 'required': ['openapi', 'info', 'paths'], 'properties': {
    'openapi': {'type': 'string', 'pattern': r'^3\.0\.'}}}

# ---- TAP ----------------------------------------------------------------------------------------------------------------

count = 0


def check(good, name, detail=''):
    global count
    count += 1
    print(f'{"ok" if good else "not ok"} {count} - {name}')
    if not good:
        print('#   ' + str(detail)[:600].replace('\n', '\n#   '))


def valid(document, schema, name):
    try:
        jsonschema.Draft4Validator(schema).validate(document)
        check(True, name)
    except jsonschema.ValidationError as error:
        check(False, name, f'{list(error.absolute_path)}: {error.message}')


def draft4(schema):
    """A schema object of OpenAPI 3.0 for a validator: nullable is a type there."""
    if isinstance(schema, list):
        return [draft4(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    new = {name: draft4(value) for name, value in schema.items() if name != 'nullable'}
    return {'anyOf': [new, {'type': 'null'}]} if schema.get('nullable') is True else new


# ---- Data ---------------------------------------------------------------------------------------------------------------

def octahedron(n):
    """A cube of n^3 quads, pushed out to an ellipsoid, as ASCII PLY."""
    points, faces = {}, []

    def vertex(p):
        length = sum(x * x for x in p) ** 0.5
        return points.setdefault(tuple(round(s * x / length, 9) for s, x in zip((1.0, 0.8, 0.6), p)), len(points))

    for axis in range(3):
        for side in (-1, 1):
            for i in range(n):
                for j in range(n):
                    corners = []
                    for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                        p = [0.0, 0.0, 0.0]
                        p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = side, 2 * a / n - 1, 2 * b / n - 1
                        corners.append(vertex(p))
                    faces.append(corners if side > 0 else corners[::-1])
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    head = (f'ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\n'
            f'property float z\nelement face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n')
    return head + ''.join('%g %g %g\n' % p for p in points) + ''.join('3 %d %d %d\n' % t for t in triangles)


def ball(n):
    """A ball of voxels as NRRD."""
    head = f'NRRD0004\ntype: uint8\ndimension: 3\nsizes: {n} {n} {n}\nencoding: raw\nspace: RAS\n' \
           'space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n\n'
    middle = (n - 1) / 2
    inside = [(x - middle) ** 2 + (y - middle) ** 2 + (z - middle) ** 2 < (n / 3) ** 2
              for z in range(n) for y in range(n) for x in range(n)]
    return head.encode() + struct.pack(f'{n ** 3}B', *inside)


def coefficients(bump):
    """An ellipsoid with a bump, of degree 4: real harmonics in the order l*l + l + m."""
    x, y, z = ([0.0] * 25 for _ in range(3))
    x[3], y[1], z[2] = 1.0, 0.9, 0.8
    x[6], y[8], z[12], z[20] = 0.1 * bump, 0.05, 0.07 * bump, 0.02 * bump * bump
    return {'coefficients': {'lmax': 4, 'x': x, 'y': y, 'z': z}}


class Service:
    def __init__(self, url):
        self.url = url
        self.client = Processes(url + '/v1')

    def send(self, path, **request):
        answer = requests.post(self.url + path, timeout=60, **request)
        answer.raise_for_status()
        return answer.json()

    def execute(self, process, body, prefer=None):
        return http_post(self.client._build_url(f'processes/{process}/execution'), body, timeout=400,
                         headers={'Prefer': prefer} if prefer else None)

    def get(self, path):
        return requests.get(self.url + path, timeout=60)

    def wait(self, job):
        for _ in range(3000):  # a busy machine, with sanitizers
            status = self.get(f'/v1/jobs/{job}').json()
            if status['status'] not in ('accepted', 'running'):
                return status
            time.sleep(0.1)
        return status


WAIT = 'wait=300'  # however busy the machine is


def make_inputs(service):
    def link(path):
        return {'href': f'{service.url}/v1/{path}', 'type': 'application/json'}

    mesh = service.send('/v1/meshes?format=ply', data=octahedron(8))['id']
    volume = service.send('/v1/volumes', data=ball(16))['id']
    a, b, c, d, e, f = (service.send('/v1/surfaces', json=coefficients(bump))['id'] for bump in (0, 0.2, 0.4, 0.6, 0.8, 1))
    members = [{'id': one, 'label': label, 'subject': one[-6:]} for one, label in zip((a, b, c, d, e, f), 'ppphhh')]
    service.send('/v1/cohorts', json={'name': 'six', 'members': members})

    sided = [{'id': service.send('/v1/surfaces', json=coefficients(0.04 * i + 0.2 * side))['id'], 'subject': f's{i}',
              'time': side, 'side': ('left', 'right')[side], 'covariates': {'part': 'ab'[side]}} for i in range(5) for side in (0, 1)]
    service.send('/v1/cohorts', json={'name': 'pairs', 'members': sided})
    parts = [{'id': service.send('/v1/surfaces', json=coefficients(0.2 * i + j))['id'], 'subject': f's{i}', 'label': 'xy'[i % 2],
              'covariates': {'part': 'ab'[j]}} for i in range(10) for j in (0, 1)]
    service.send('/v1/cohorts', json={'name': 'parts', 'members': parts})
    few = {'name': 'few-parts', 'members': parts[:12]}  # a label of three subjects is enough to classify, not to train
    service.send('/v1/cohorts', json=few)
    pairs = {'cohort': link('cohorts/pairs'), 'register': False, 'permutations': 9, 'bootstraps': 100}

    ten = [service.send('/v1/surfaces', json=coefficients(0.1 * i))['id'] for i in range(10)]
    service.send('/v1/cohorts', json={'name': 'ten', 'members': [
        {'id': one, 'label': 'pr'[i % 2]} for i, one in enumerate(ten)]})
    light = {'method': 'srnf-nn', 'commonPose': True}  # searches of a registration are not its concern
    kept = {'cohort': 'ten', **light}

    group = {'surfaces': [a, {'value': b}, link(f'surfaces/{c}')], 'register': {'value': False}}
    pair = {'from': link(f'surfaces/{a}'), 'to': {'value': b}, 'register': False}
    model = service.execute('pca', {'inputs': {'cohort': link('cohorts/six'), 'register': False}}, WAIT).json()['model']['id']
    return {
        'extract': {'volume': link(f'volumes/{volume}'), 'labels': [1]},
        'encode': {'mesh': link(f'meshes/{mesh}'), 'lmax': {'value': 6}},
        'repair': {'mesh': mesh},
        'mirror': {'surface': a},
        'invert': {'srnf': {'value': {'surface': b}}, 'maxIterations': 5},
        'geodesic': {**pair, 'steps': 3},
        'register': {'template': a, 'moving': b, 'reparameterization': False},
        'distances': group,
        'mean': group,
        'pca': group,
        'modes': {'model': model, 'coefficients': [1]},
        'sample': {'model': link(f'models/{model}'), 'count': 1},
        'project': {'model': model, 'surface': link(f'surfaces/{a}')},
        'neighbours': {'surfaces': [a, b, c], 'k': 1},
        'score': {'model': model, 'surface': link(f'surfaces/{a}'), 'map': False},
        'evaluate-model': {'cohort': 'six', 'register': False, 'samples': 10},
        'compare-groups': {'cohort': link('cohorts/six'), 'register': False, 'permutations': 10},
        'regress': {'cohort': link('cohorts/six'), 'formula': 'shape ~ label', 'register': False, 'permutations': 9,
                    'bootstraps': 100},
        'change': pairs,
        'asymmetry': pairs,
        'pca-parts': {'cohort': link('cohorts/pairs'), 'register': False, 'modes': 0},
        'trajectories': pairs,
        'classify-parts': {'cohort': link('cohorts/few-parts'), **light},
        'classify': {'cohort': 'six', 'refit': 'shared', **light},
        'train': kept,
        'train-parts': {'cohort': link('cohorts/parts'), **light},
        'predict': {'model': service.execute('train', {'inputs': kept}, WAIT).json()['model']['id'], 'surfaces': [a]},
        'report': {'cohort': link('cohorts/six'), 'modes': 1},
        'shoot': {'surface': a, 'velocity': {'value': {'toward': b}}, 'times': [0.5], 'register': False},
        'transport': {**pair, 'vector': {'toward': c}},
        'transfer': {'source': a, 'deformed': b, 'target': c, 'register': False},
    }


# ---- The requirements ---------------------------------------------------------------------------------------------------

def required(service, process, others):
    """What the description of a process requires, of the meshes, surfaces and models that others have."""
    made = {'mesh': others['repair']['mesh'], '(surf|mesh)': others['mirror']['surface'], 'model': others['modes']['model']}
    inputs = {}
    for name, one in service.client.process(process)['inputs'].items():
        kind = one['schema'].get('pattern', '').lstrip('^').split('-')[0]
        if name == 'surfaces':
            inputs[name] = others['neighbours']['surfaces']
        elif one.get('minOccurs', 1):
            inputs[name] = made[kind]
    return inputs


def test_service(service):
    client = service.client
    valid(client.response, LANDING, '/req/core/landingpage-success: the landing page')
    rels = {link['rel']: link for link in client.links}
    check({'self', 'service-desc', 'service-doc', OGC + 'conformance', OGC + 'processes', OGC + 'job-list'} <= set(rels),
          '/req/core/landingpage-success: has its links', sorted(rels))
    check(all(requests.get(link['href'], timeout=60).status_code == 200 for link in client.links),
          '/req/core/api-definition-op: and each leads somewhere', client.links)
    valid(client.api(), OPENAPI, '/req/oas30/oas-definition-1: OWSLib finds the description in OpenAPI 3.0')
    paths = client.api()['paths']
    check({'/v1/processes', '/v1/conformance', '/v1/jobs', '/v1/jobs/{id}', '/v1/jobs/{id}/results'} <= set(paths),
          '/req/oas30/oas-impl: with the paths of the standard', sorted(paths))
    conformance = client.conformance()
    valid(conformance, CONFORMANCE, '/req/core/conformance-success: the conformance declaration')
    classes = {uri.rsplit('/', 1)[1] for uri in conformance['conformsTo']}
    check(classes == {'core', 'ogc-process-description', 'json', 'oas30', 'job-list', 'dismiss'},
          '/req/core/conformance-success: has the classes', classes)
    check(service.get('/v1/nothing').status_code == 404 and
          requests.delete(service.url + '/v1/processes', timeout=60).status_code == 405, '/req/core/http: other requests')


def test_list(service):
    listed = service.client.processes()
    valid(listed, PROCESSES, '/req/core/process-list-success: the list of processes')
    few = service.get('/v1/processes?limit=2').json()
    check(len(few['processes']) == 2, '/req/core/pl-limit-response: no more than were asked for')
    check({'self', 'next'} <= {link['rel'] for link in few['links']}, '/req/core/pl-links: with links', few['links'])
    rest, seen = few, [one['id'] for one in few['processes']]
    while any(link['rel'] == 'next' for link in rest['links']):
        rest = service.get(next(link['href'] for link in rest['links'] if link['rel'] == 'next')).json()
        seen += [one['id'] for one in rest['processes']]
    ids = [one['id'] for one in listed['processes']]
    check(seen == ids, '/req/core/pl-links: that lead through all of them', seen)
    check(service.get('/v1/processes?limit=0').status_code >= 400, '/req/core/pl-limit-definition: at least one')
    lost = service.get('/v1/processes/none')
    check(lost.status_code == 404 and lost.json()['type'] == EXCEPTION + 'no-such-process',
          '/req/core/process-exception/no-such-process', lost.text)
    valid(lost.json(), EXCEPTIONS, '/req/core/process-exception/no-such-process: as an exception')
    return ids


def check_values(document, description, process):
    """A document of results against the description of its outputs."""
    for name, value in document.items():
        bare = value['value'] if isinstance(value, dict) and 'value' in value else value
        errors = list(jsonschema.Draft4Validator(draft4(description['outputs'][name]['schema'])).iter_errors(bare))
        if errors:
            return f'{process} {name}: {errors[0].message[:200]}'
    return ''


def test_process(service, process, inputs):
    description = service.client.process(process)
    valid(description, PROCESS, f'/req/ogc-process-description/json-encoding: {process} is described')
    check(set(inputs) <= set(description['inputs']) and
          {name for name, one in description['inputs'].items() if one['minOccurs'] > 0} <= set(inputs),
          f'/req/ogc-process-description/inputs-def: {process}: what must be given', inputs)
    answer = service.execute(process, {'inputs': inputs, 'response': 'document'}, 'respond-async')
    valid(answer.json(), STATUS, f'/req/core/process-execute-success-async: {process}')
    check(answer.status_code == 201 and answer.headers['Location'] == '/v1/jobs/' + answer.json().get('jobID', ''),
          f'/req/core/process-execute-success-async: {process}: with its place', answer.text)
    job = answer.json().get('jobID')
    status = service.wait(job)
    valid(status, STATUS, f'/req/core/job-success: {process}')
    check(status['status'] == 'successful', f'/req/core/job-success: {process} ends well', status)
    results = service.get(f'/v1/jobs/{job}/results')
    valid(results.json(), RESULTS, f'/req/core/job-results-async-document: {process}')
    document = service.execute(process, {'inputs': inputs, 'response': 'document'})
    check(document.status_code == 200 and document.json() == results.json(),
          f'/req/core/process-execute-sync-document: {process} answers the same at once')
    wrong = check_values(results.json(), description, process)
    check(not wrong, f'/req/ogc-process-description/output-def: {process}: outputs are as described', wrong)
    return job, results.json()


def test_raw(service, inputs):
    def run(outputs, response='raw'):
        return service.execute('distances', {'inputs': inputs, 'response': response, 'outputs': outputs})

    one = run({'matrix': {'transmissionMode': 'value'}})
    check(one.status_code == 200 and len(one.json()) == 3, '/req/core/process-execute-sync-raw-value-one', one.text)
    several = run({'matrix': {}, 'labels': {}})
    check(several.headers['Content-Type'].startswith('multipart/related') and
          several.text.count('Content-Type: application/json') == 2, '/req/core/process-execute-sync-raw-value-multi')
    links = run({'matrix': {'transmissionMode': 'reference'}, 'labels': {'transmissionMode': 'reference'}})
    found = requests.utils.parse_header_links(links.headers['Link'])
    href = next(link['url'] for link in found if link['url'].endswith('/matrix'))
    check(links.status_code == 204 and service.get(href).json() == one.json(),
          '/req/core/process-execute-sync-raw-ref', links.headers)
    document = run({'matrix': {'transmissionMode': 'reference'}, 'labels': {}}, 'document').json()
    valid(document, RESULTS, '/req/core/process-execute-sync-document: with a reference')
    check(set(document) == {'matrix', 'labels'} and service.get(document['matrix']['href']).json() == one.json(),
          '/req/core/process-execute-sync-document: only what was asked for', document)
    plain = service.execute('distances', {'inputs': inputs})
    check(plain.json()['matrix'] == one.json() and 'inputs' in plain.json(),
          '/req/core/process-execute-default-outputs: all of them')
    monitor = plain.links.get('monitor', {}).get('url', '')
    valid(service.get(monitor).json(), STATUS, '/req/core/job-results-success-sync: the job of an answer at once')
    check(plain.status_code == 200, '/req/core/process-execute-default-execution-mode')
    wrong = run({'none': {}})
    check(wrong.status_code == 422 and wrong.json()['errors'][0]['pointer'] == '/outputs/none',
          '/req/core/process-execute-request: an output that there is not', wrong.text)


def test_inputs(service, job, surface):
    def run(inputs):
        return service.execute('geodesic', {'inputs': {'register': False, 'steps': 3, **inputs}, 'response': 'document'})

    chained = run({'from': {'href': f'{service.url}/v1/jobs/{job}/results/surface'}, 'to': surface})
    check(chained.status_code == 200, '/req/core/process-execute-inputs: an output of a job by reference', chained.text)
    for href in ('http://elsewhere.example/v1/surfaces/' + surface, '/v1/version', '//elsewhere.example/x', 'file:///x',
                 '/v1/surfaces/%zz'):
        refused = run({'from': {'href': href}, 'to': surface})
        check(refused.status_code == 422 and refused.json()['errors'][0]['pointer'] == '/inputs/from',
              f'/req/core/process-execute-inputs: {href} is not followed', refused.text)
    refused = run({'from': {'value': 7}, 'to': surface})
    check(refused.status_code == 422 and refused.json()['errors'][0]['pointer'] == '/inputs/from',
          '/req/core/process-execute-input-validation', refused.text)
    refused = service.execute('geodesic', {'inputs': {}, 'subscriber': {'successUri': 'http://elsewhere.example/'}})
    check('/subscriber' in [one['pointer'] for one in refused.json()['errors']], 'callbacks are refused by name')


def test_jobs(service, surface):
    inputs = {'srnf': {'value': {'surface': surface}}, 'initial': 'sphere', 'method': 'gradient', 'tolerance': 1e-30,
              'maxIterations': 100000, 'lmax': 31}
    job = service.execute('invert', {'inputs': inputs, 'response': 'raw'}, 'respond-async').json()['jobID']
    early = service.get(f'/v1/jobs/{job}/results')
    check(early.status_code == 404 and early.json()['type'] == EXCEPTION + 'result-not-ready',
          '/req/core/job-results-exception/results-not-ready', early.text)
    dismissed = requests.delete(f'{service.url}/v1/jobs/{job}', timeout=60)
    valid(dismissed.json(), STATUS, '/req/dismiss/job-dismiss-success: a job that has not ended')
    check(dismissed.status_code == 200 and dismissed.json()['status'] == 'dismissed',
          '/req/dismiss/job-dismiss-success', dismissed.text)
    check(service.get(f'/v1/jobs/{job}').json()['status'] == 'dismissed', '/req/dismiss/job-dismiss-op: it stays so')
    for path in (f'/v1/jobs/{job}x', f'/v1/jobs/{job}x/results'):
        lost = service.get(path)
        check(lost.status_code == 404 and lost.json()['type'] == EXCEPTION + 'no-such-job',
              '/req/core/job-exception-no-such-job', lost.text)
    with open('tests/data/aal_subcortex/L_hippocampus.ply', 'rb') as file:
        bent = service.send('/v1/meshes', data=file.read())['id']
    failing = {'mesh': bent, 'parameterization': 'star', 'lmax': 4}
    failed = service.wait(service.execute('encode', {'inputs': failing}, 'respond-async').json()['jobID'])
    valid(failed, STATUS, '/req/core/job-success: a job that failed')
    reason = service.get(f'/v1/jobs/{failed["jobID"]}/results')
    valid(reason.json(), EXCEPTIONS, '/req/core/job-results-failed')
    check(failed['status'] == 'failed' and reason.status_code == 422, '/req/core/job-results-failed: with its status',
          reason.text)
    listed = service.get('/v1/jobs').json()
    valid(listed, JOBS, '/req/job-list/job-list-success')
    check({'self'} <= {link['rel'] for link in listed['links']}, '/req/job-list/links', listed['links'])
    check(len(service.get('/v1/jobs?limit=1').json()['jobs']) == 1, '/req/job-list/limit-response')
    test_job_parameters(service)


# The parameters of the job list, and what the description says of them: arrays are repeated, as OpenAPI has it by default,
# or a list with commas.
PARAMETERS = {'type': 'array', 'processID': 'array', 'status': 'array', 'datetime': 'string', 'minDuration': 'integer',
              'maxDuration': 'integer'}


def resolved_parameters(service, path):
    document = service.get('/v1/openapi.json').json()
    for one in document['paths'][path]['get']['parameters']:
        yield document['components']['parameters'][one['$ref'].rsplit('/', 1)[1]]


def seconds(job):
    return (instant(job['finished']) - instant(job['started'])).total_seconds()


def instant(text):
    return datetime.datetime.fromisoformat(text.replace('Z', '+00:00'))


def test_job_parameters(service):
    described = {one['name']: one['schema'] for one in resolved_parameters(service, '/v1/jobs')}
    for name, kind in PARAMETERS.items():
        check(described.get(name, {}).get('type') == kind, f'/req/job-list/{name}-definition', described.get(name))

    def listed(query):
        answer = service.get(f'/v1/jobs?limit=200&{query}')
        return answer.json()['jobs'] if answer.status_code == 200 else answer.text
    everything = listed('')
    check(listed('type=process') == everything, '/req/job-list/type-response: all jobs are of processes')
    check(listed('type=other') == [] and listed('type=other,process') == everything, '/req/job-list/type-response: others')
    check(listed('type=' + ','.join(32 * ['process'])) == everything, '/req/job-list: as many types as are allowed')
    for query in ('processID=encode&processID=distances', 'processID=encode,distances', 'processID=encode%2Cdistances'):
        check(listed(query) == [one for one in everything if one['processID'] in ('encode', 'distances')],
              f'/req/job-list/processid-response: {query}')
    for query in ('status=dismissed&status=failed', 'status=failed,dismissed'):
        check(listed(query) == [one for one in everything if one['status'] in ('dismissed', 'failed')],
              f'/req/job-list/status-response: {query}')
    check({one['status'] for one in listed('status=dismissed')} == {'dismissed'}, '/req/job-list/status-response: one')
    first, last = everything[-1]['created'], everything[0]['created']
    middle = everything[len(everything) // 2]['created']
    for query, wanted in ((f'{first}/{last}', lambda at: True), (f'../{middle}', lambda at: at <= middle),
                          (f'/{middle}', lambda at: at <= middle), (f'{middle}/..', lambda at: at >= middle),
                          (f'{middle}/', lambda at: at >= middle), (middle, lambda at: at == middle),
                          (middle[:10], lambda at: at[:10] == middle[:10]),
                          (middle[:19] + 'Z', lambda at: at[:19] == middle[:19])):
        check(listed(f'datetime={query}') == [one for one in everything if wanted(one['created'])],
              '/req/job-list/datetime-response: ' + query.replace(middle, 'T').replace(first, 'A').replace(last, 'Z')[:12])
    ended = [one for one in everything if 'started' in one and 'finished' in one]
    for low, high in ((0, None), (None, 0), (1, None), (None, 1), (0, 1), (3600, None)):
        query = '&'.join(f'{name}={value}' for name, value in (('minDuration', low), ('maxDuration', high))
                         if value is not None)
        wanted = [one['id'] for one in ended if (low is None or seconds(one) >= low) and
                  (high is None or seconds(one) <= high)]
        check([one['id'] for one in listed(query)] == wanted, f'/req/job-list/duration-response: {query}')
    check(listed('minDuration=0&status=failed') == [one for one in ended if one['status'] == 'failed'],
          '/req/job-list/duration-response: of those of a status')
    for query in ('processID=nosuch', 'processID=', 'status=paused', 'datetime=yesterday', 'datetime=../..', 'datetime=/',
                  'datetime=' + last + '/' + first, 'minDuration=-1', 'minDuration=a', 'maxDuration=1.5',
                  'minDuration=2&maxDuration=1', 'process=encode&processID=encode', 'type=' + 33 * 'process,',
                  '&'.join(33 * ['processID=encode']), 'type=' + 65 * 'a', 'status=' + ','.join(33 * ['running'])):
        answer = service.get('/v1/jobs?' + query)
        valid(answer.json(), EXCEPTIONS, f'/req/job-list: {query.split("Z")[0][:20]} is refused')
        check(answer.status_code == 422, '/req/job-list: with 422', answer.text)


def main():
    service = Service(sys.argv[1])
    test_service(service)
    processes = test_list(service)
    inputs = make_inputs(service)
    jobs = {}
    for process in processes:
        jobs[process] = test_process(service, process, inputs.get(process) or required(service, process, inputs))
    surface = inputs['mirror']['surface']
    test_raw(service, inputs['distances'])
    test_inputs(service, jobs['encode'][0], surface)
    test_jobs(service, surface)
    print(f'1..{count}')


main()
