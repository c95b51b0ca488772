; the goal speaks of every toy and of some box
(define (domain tidy)
  (:requirements :strips :typing :negative-preconditions :quantified-preconditions)
  (:types toy box)
  (:predicates (in ?t - toy ?b - box) (on-floor ?t - toy) (open ?b - box))
  (:action open-box
    :parameters (?b - box)
    :precondition (not (open ?b))
    :effect (open ?b))
  (:action close-box
    :parameters (?b - box)
    :precondition (and (open ?b) (exists (?t - toy) (in ?t ?b)))
    :effect (not (open ?b)))
  (:action store
    :parameters (?t - toy ?b - box)
    :precondition (and (on-floor ?t) (open ?b))
    :effect (and (in ?t ?b) (not (on-floor ?t)))))
