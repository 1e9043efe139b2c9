/*
 * schemas_classify.c - the inputs and outputs of classify as JSON Schema (2020-12). As
 * schemas.c, which has the others.
 */
#include "api/cohorts.h"
#include "toolkit/schemas.h"

#define CLASSIFY_COMPONENTS_MAX_TEXT PROCESS_TEXT(PROCESS_CLASSIFY_COMPONENTS_MAX)
#define SIZE_WEIGHT_MAX_TEXT PROCESS_TEXT(PROCESS_SIZE_WEIGHT_MAX)

#define METHODS                                                                        \
    "[\"srnf-gauss\",\"srnf-nn\",\"srm-gauss\",\"srm-nn\",\"harmonic-nn\",\"icp-nn\"," \
    "\"spharm-pdm\"]"

const char classify_inputs_schema[] = INPUTS_OPENING
    "\"required\":[\"cohort\"],\"properties\":{\"cohort\":{"
    "\"type\":\"string\",\"pattern\":\"" COHORT_NAME_PATTERN
    "\",\"description\":\"Name of a cohort whose members have labels, each of them members of "
    "three subjects at least.\"}," MIXED_ROUTES_INPUT ",\"method\":{\"oneOf\":[{\"enum\":" METHODS
    "},{\"type\":\"array\",\"minItems\":1,\"uniqueItems\":true,\"items\":{\"enum\":" METHODS
    "}}],\"default\":[\"srnf-gauss\"],\"description\":\"One method or several. gauss: a "
    "normal distribution for each class on principal components; nn: nearest neighbour, by SRNFs, "
    "square-root maps, surfaces as parameterised, closest points, or points that the first-order "
    "ellipsoids make correspond.\"},\"components\":{\"oneOf\":[{\"enum\":[\"auto\"]},{"
    "\"type\":\"integer\",\"minimum\":1,\"maximum\":" CLASSIFY_COMPONENTS_MAX_TEXT
    "}],\"default\":\"auto\",\"description\":\"Of the Gaussians; auto: chosen inside each "
    "fold, of 20 at most.\"},\"covariance\":{\"enum\":[\"auto\",\"pooled\",\"class\"],"
    "\"default\":\"auto\",\"description\":\"One for all classes, or one for each; auto: "
    "chosen inside each fold.\"},\"validation\":{\"enum\":[\"loo\"],\"default\":\"loo\","
    "\"description\":\"Leave-one-out: every fold leaves out all members of a "
    "subject.\"},\"scale\":{\"enum\":[\"shape\","
    "\"shape-and-size\"],\"default\":\"shape\",\"description\":\"Whether the log of the "
    "size counts beside shape.\"},\"sizeWeight\":{\"type\":\"number\",\"minimum\":0,"
    "\"maximum\":" SIZE_WEIGHT_MAX_TEXT ",\"default\":1.0,\"description\":\"Of size in "
    "distances; at 1 it weighs as much as shape. Gaussians need none.\"},\"permutations\":{"
    "\"type\":\"integer\",\"minimum\":0,\"maximum\":" PERMUTATIONS_MAX_TEXT
    ",\"default\":0,\"description\":\"Of the labels of whole subjects, for the p-value; 0: none. "
    "Refused where labels differ within a subject.\"},\"seed\":{"
    "\"type\":\"integer\",\"minimum\":0,\"maximum\":" SEED_MAX_TEXT
    ",\"default\":0,\"description\":\"Of the permutations.\"},\"refit\":{"
    "\"enum\":[\"fold\",\"shared\"],\"default\":\"fold\",\"description\":\"fold: each "
    "fold registers all to what its own training subjects give; shared: all are registered once, "
    "to what all of them give, which is faster and lets the shape of the one left out, not its "
    "label, into the registrations.\"},\"commonPose\":{\"type\":\"boolean\","
    "\"default\":false,\"description\":\"The surfaces share a pose: no registration "
    "rotates.\"},\"lmax\":{\"type\":\"integer\",\"minimum\":" DEGREE_MIN_TEXT
    ",\"maximum\":" DEGREE_MAX_TEXT ",\"description\":\"Degree of the comparison; the surfaces "
    "are cut or filled up to it. Default: the largest of theirs. 15 is enough for most.\"}}}";

const char classify_outputs_schema[] = OUTPUTS_OPENING
    "\"methods\":{\"type\":\"object\",\"description\":\"By name: accuracy; correct; "
    "confidenceInterval (Wilson, 95 %, with effectiveCount members, n p (1 - p) over the "
    "variance of p between subjects: Rao and Scott 1992); confusion (rows: labels, columns: "
    "predictions, in the order of classes); perSubject, of each member [{subject, label, "
    "predicted, logLikelihoods or nearestDistances, of each class; typicality, {value, limit, "
    "percentile} of its residual, distance and mahalanobis in the fold that left it out, or of "
    "its nearest distance, among those of the members of other subjects: beyond a limit it is "
    "unlike every class; a limit is null where the others are too few, or too unlike each other, "
    "to "
    "set one}]; components and covariance of each fold, or null; pValue, (1 + b) / (1 + "
    "m) with b of m relabellings of "
    "whole subjects at least as good, pValueIsFloor (the smallest that the test can give) "
    "and pValueInterval (Wilson's 95 % interval of the p that all relabellings would give; "
    "the point itself where exact), or null; refitted inside each fold, and shared between "
    "folds.\"},\"members\":{\"type\":\"integer\"},\"subjects\":{\"type\":\"integer\","
    "\"description\":\"Members "
    "without a subject are subjects of their "
    "own.\"},\"chance\":{\"type\":\"number\",\"description\":\"1 / number of classes: what "
    "the Gaussians, which take classes for equally likely, get right by "
    "chance.\"},\"majorityRate\":{\"type\":\"number\",\"description\":\"Share of the largest "
    "class: what always naming it gets right. An accuracy is to be compared with the larger "
    "of this and "
    "chance.\"},\"permutations\":{\"type\":\"integer\",\"description\":\"Relabellings that "
    "the observed labels were compared with; 0: "
    "none.\"},\"relabellings\":{\"type\":[\"number\",\"null\"],\"description\":\"Different "
    "ones that whole subjects can have, the observed among them; null: no test, or beyond "
    "all numbers.\"},\"exact\":{\"type\":[\"boolean\",\"null\"],\"description\":\"Whether "
    "all of them were taken, each once, since there were no more than asked for; null: no "
    "test.\"},\"classes\":{\"type\":\"array\",\"items\":{"
    "\"type\":\"string\"},\"description\":\"The labels, in the order in which they first "
    "appear.\"},\"lmax\":{\"type\":\"integer\"}," BRIDGED_GROUP
    "\"registration\":{\"type\":\"object\","
    "\"description\":\"Of the methods that register: degree, penalty and all other "
    "options.\"}," MADE_BY;
