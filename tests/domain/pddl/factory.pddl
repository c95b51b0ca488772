; types that have things of their own and types below them, and things without any type
(define (domain factory)
  (:requirements :strips :typing :negative-preconditions :universal-preconditions)
  (:types machine - object press lathe - machine part)
  (:predicates (works ?m - machine) (made ?p - part ?m - machine) (raw ?p - part)
               (approved ?x) (marked ?x))
  (:action run
    :parameters (?m - machine ?p - part)
    :precondition (and (works ?m) (raw ?p))
    :effect (and (made ?p ?m) (not (raw ?p))))
  (:action repair
    :parameters (?m - machine)
    :precondition (not (works ?m))
    :effect (works ?m))
  (:action mark
    :parameters (?x)
    :effect (marked ?x))
  (:action approve
    :parameters (?x)
    :precondition (and (marked ?x) (forall (?p - part) (not (raw ?p))))
    :effect (approved ?x)))
