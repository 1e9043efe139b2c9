/*
 * table.h - a process as one declaration: a table of its inputs, a table of its outputs,
 * and a function that runs it on typed inputs.
 *
 * From the table of inputs come their validation with JSON pointers, the canonical form (every
 * option after defaulting, by which cached results are found), the typed struct that run gets, and
 * the JSON Schema at /v1/processes/{id} and in api/openapi.yaml. So a limit, a default or a unit
 * stands in one place.
 */
#ifndef SRNFD_TOOLKIT_TABLE_H
#define SRNFD_TOOLKIT_TABLE_H

#include "toolkit/process.h"

/* What an input is, and the C type of its member in the typed inputs. */
enum input_kind {
    INPUT_INTEGER, /* long; with nullable, null is 0 */
    INPUT_REAL,    /* double */
    INPUT_BOOLEAN, /* bool */
    INPUT_CHOICE,  /* int, its place among choices; the first is the default */
    INPUT_NUMBERS, /* struct input_numbers */
    INPUT_MESH,    /* char[STORE_ID_MAX]; a mesh that exists and can be analysed */
    INPUT_SURFACE, /* char[STORE_ID_MAX]; a surface, or a mesh that can be encoded */
    INPUT_MODEL,   /* char[STORE_ID_MAX]; of the kind that the row names */
    INPUT_OWN,     /* what the process makes of it: see struct input_own */
};

struct input_numbers {
    size_t n;
    double values[INPUTS_NUMBERS_MAX];
};

struct process_input;

/* An input of a shape of its own. */
struct input_own {
    const char *schema; /* members of its schema but description, as JSON without the braces */
    /* Checks the member and sets the canonical one, or notes a problem. */
    void (*read)(struct process_inputs *inputs, const struct process_input *input);
    /* The member of the typed inputs from the canonical value. False: no memory. */
    bool (*type)(const json_t *value, void *member);
    void (*clear)(void *member); /* may be NULL */
    /* Shortens the canonical value for the result: numbers by their digest. May be NULL. */
    void (*echo)(json_t *value);
    bool refers; /* to the store: it is read after all that can be judged by itself */
};

struct process_input {
    const char *name;
    enum input_kind kind;
    size_t member; /* offset in the typed inputs */
    const char *text;
    /* Of numbers: limits, both included. */
    double lowest, highest;
    double fallback; /* of INTEGER and REAL, and of BOOLEAN as 0 or 1 */
    bool required;
    bool nullable; /* null is a value, and the default */
    bool derived;  /* the default follows from other inputs: complete sets it */
    bool open;     /* the upper limit follows from other inputs: complete checks it, highest is the
                      largest that it can be */
    const char *unless; /* another input: where that is given, this one must be left out or null,
                           is null in canonical form, and zero when typed; NULL: none */
    const char *const *choices;          /* of CHOICE, ended by NULL */
    const char *model_kind;              /* of MODEL (api/models.h); NULL: components */
    size_t most;                         /* of NUMBERS: elements */
    const struct input_numbers *numbers; /* of NUMBERS: the default */
    const struct input_own *own;
};

/* One member of the result. inputs, warnings and numericBuild come by themselves. */
struct process_output {
    const char *name;
    const char *schema; /* as input_own.schema; one of the macros below where one fits */
    const char *text;
};
#define OUTPUT_NUMBER "\"type\":\"number\""
#define OUTPUT_NUMBER_OR_NULL "\"type\":[\"number\",\"null\"]"
#define OUTPUT_INTEGER "\"type\":\"integer\""
#define OUTPUT_BOOLEAN "\"type\":\"boolean\""
#define OUTPUT_STRING "\"type\":\"string\""
#define OUTPUT_OBJECT "\"type\":\"object\""
#define OUTPUT_OBJECT_OR_NULL "\"type\":[\"object\",\"null\"]"
#define OUTPUT_ARRAY "\"type\":\"array\""
#define OUTPUT_NUMBERS "\"type\":\"array\",\"items\":{" OUTPUT_NUMBER "}"
#define OUTPUT_NUMBERS_OR_NULLS "\"type\":\"array\",\"items\":{" OUTPUT_NUMBER_OR_NULL "}"
#define OUTPUT_STRINGS "\"type\":\"array\",\"items\":{" OUTPUT_STRING "}"
#define OUTPUT_MATRIX "\"type\":\"array\",\"items\":{" OUTPUT_NUMBERS_OR_NULLS "}"
#define OUTPUT_OBJECTS "\"type\":\"array\",\"items\":{" OUTPUT_OBJECT "}"

struct process_table {
    const struct process_input *inputs; /* ended by name NULL */
    const struct process_output *outputs;
    size_t size; /* of the typed inputs */
    /* Checks what holds between inputs before any that refers to the store is looked up; a wrong
       one is missing in inputs->canonical. May be NULL. */
    void (*check)(struct process_inputs *inputs);
    /* The same when each input is right by itself and was found; sets derived ones in
       inputs->canonical. May be NULL. */
    void (*complete)(struct process_inputs *inputs);
    /* Returns the result document (process_finish adds the rest), or NULL with the problem set. */
    json_t *(*run)(struct jobs_run *run, const void *typed, struct jobs_result *result);
};

/* The canonical inputs (new reference), or NULL with problems in list or an answer in the call. */
json_t *table_canonicalize(const struct process_table *table, struct api_call *call,
                           const json_t *given, struct problem_list *list);
/* JSON Schemas of both sides (new references; NULL: no memory). */
json_t *table_inputs_schema(const struct process_table *table);
json_t *table_outputs_schema(const struct process_table *table);
/* Canonical inputs as the typed struct, zeroed first. False: no memory, or they are not of this
   table. table_clear frees what it owns, also then. */
bool table_type(const struct process_table *table, const json_t *canonical, void *typed);
void table_clear(const struct process_table *table, void *typed);
/* The run of a process whose definition is a table (struct jobs_process): runs it on canonical
   inputs, and makes its document the result. user: not used. */
void table_run(struct jobs_run *run, void *user, const char *text, struct jobs_result *result);

#endif
