; some tool that is sharp enough, and no other worker at the bench: exists and forall before
(define (domain workshop)
  (:requirements :typing :existential-preconditions :universal-preconditions
                 :negative-preconditions :equality)
  (:types worker tool part bench)
  (:predicates (holds ?w - worker ?t - tool) (sharp ?t - tool) (cut ?p - part)
               (clamped ?p - part ?b - bench) (at ?w - worker ?b - bench) (rack ?t - tool))
  (:action fetch
    :parameters (?w - worker ?t - tool)
    :precondition (and (rack ?t) (not (exists (?o - tool) (holds ?w ?o))))
    :effect (and (holds ?w ?t) (not (rack ?t))))
  (:action return-tool
    :parameters (?w - worker ?t - tool)
    :precondition (holds ?w ?t)
    :effect (and (rack ?t) (not (holds ?w ?t))))
  (:action sharpen
    :parameters (?w - worker ?t - tool)
    :precondition (holds ?w ?t)
    :effect (sharp ?t))
  (:action leave
    :parameters (?w - worker ?b - bench)
    :precondition (at ?w ?b)
    :effect (not (at ?w ?b)))
  (:action cut-part
    :parameters (?w - worker ?p - part ?b - bench)
    :precondition (and (at ?w ?b) (clamped ?p ?b)
                       (exists (?t - tool) (and (holds ?w ?t) (sharp ?t)))
                       (forall (?o - worker) (or (= ?o ?w) (not (at ?o ?b)))))
    :effect (cut ?p)))
