; derived over roads that go in a circle
(define (domain roads)
  (:requirements :strips :typing :derived-predicates :disjunctive-preconditions
                 :existential-preconditions :negative-preconditions)
  (:types town truck)
  (:predicates (road ?a ?b - town) (blocked ?a ?b - town) (at ?t - truck ?x - town)
               (reachable ?a ?b - town) (cleared))
  (:derived (reachable ?from ?to - town)
    (and (road ?from ?to) (not (blocked ?from ?to))))
  (:derived (reachable ?a ?b - town)
    (exists (?to - town) (and (road ?a ?to) (not (blocked ?a ?to)) (reachable ?to ?b))))
  (:action travel
    :parameters (?t - truck ?a ?b - town)
    :precondition (and (at ?t ?a) (reachable ?a ?b))
    :effect (and (at ?t ?b) (not (at ?t ?a))))
  (:action clear-road
    :parameters (?t - truck ?a ?b - town)
    :precondition (and (at ?t ?a) (road ?a ?b) (blocked ?a ?b))
    :effect (and (not (blocked ?a ?b)) (cleared))))
